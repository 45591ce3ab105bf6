"""A second clip of the same objects, for users who outline objects in another clip than the watched one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from visup.render.worlds.assets.scenery import random_light, random_seed, random_sensor
from visup.render.worlds.viewpoint import fixed_camera
from visup.render.worlds.world import World

SEPARATE_CLIP_SHARE = 0.4
"""Share of worlds whose objects are outlined in another clip than the watched one."""

SUFFIX = "-shown"
"""Suffix of that clip's folder, after the name of the world."""


def teaching_world(world: World) -> World | None:
    """The world under other light, from a slightly different camera on a tripod.

    Args:
        world: The watched world.

    Returns:
        None for worlds whose objects are outlined in the watched clip.
    """
    rng = np.random.default_rng([world.seed, 2])
    if rng.random() >= SEPARATE_CLIP_SHARE:
        return None
    view = world.viewpoint
    offset = np.subtract(view.position, view.look_at)
    position = view.look_at + offset * rng.uniform(0.93, 1.07, 3)
    fov = view.fov_vertical_deg * float(rng.uniform(0.95, 1.05))
    light = random_light(rng, position)
    return replace(
        world,
        name=world.name + SUFFIX,
        viewpoint=fixed_camera(position, view.look_at, fov, world.frames),
        light=light,
        sensor=random_sensor(rng, light),
        seed=random_seed(rng),
    )

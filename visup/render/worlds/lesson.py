"""A second clip of the same things, for users who outline objects in another clip than the watched one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from visup.render.worlds.things.scenery import random_imager, random_light, seed_of
from visup.render.worlds.viewpoint import steady
from visup.render.worlds.world import World

SHARE = 0.4
"""Share of worlds whose things are outlined in another clip than the watched one."""

SUFFIX = "-shown"
"""Suffix of that clip's folder, after the name of the world."""


def lesson(world: World) -> World | None:
    """The world under other light, from a slightly different camera on a tripod.

    Args:
        world: The watched world.

    Returns:
        None for worlds whose things are outlined in the watched clip.
    """
    rng = np.random.default_rng([world.seed, 2])
    if rng.random() >= SHARE:
        return None
    view = world.viewpoint
    away = np.subtract(view.position, view.look_at)
    place = view.look_at + away * rng.uniform(0.93, 1.07, 3)
    fov = view.fov_vertical_deg * float(rng.uniform(0.95, 1.05))
    light = random_light(rng, place)
    return replace(
        world,
        name=world.name + SUFFIX,
        viewpoint=steady(place, view.look_at, fov, world.frames),
        light=light,
        imager=random_imager(rng, light),
        seed=seed_of(rng),
    )

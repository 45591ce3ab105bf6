"""The same things on another day: where a user outlines them who does not do so in the clip itself."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from visup.render.worlds.things.scenery import random_imager, random_light, seed_of
from visup.render.worlds.viewpoint import steady
from visup.render.worlds.world import World

SHARE = 0.4
"""Of worlds whose things are shown in another clip than the one that is watched."""

SUFFIX = "-shown"
"""What the folder of that clip has behind the name of the world."""


def lesson(world: World) -> World | None:
    """The world under other light, by a camera on a tripod that stands a little elsewhere.

    Args:
        world: As it is watched.

    Returns:
        None for worlds whose things are shown in themselves.
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

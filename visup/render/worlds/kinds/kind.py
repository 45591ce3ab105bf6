"""A kind of world, and helpers shared by the builders."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from visup.render.worlds.assets.scenery import random_light, random_seed, random_sensor, random_sky
from visup.render.worlds.viewpoint import fixed_camera, with_camera_motion
from visup.render.worlds.world import FPS, RigidBody, StageSpan, TaskTruth, Viewpoint, Water, World

CAMERA_MOTIONS = ("fixed", "fixed", "shaking", "panning", "zooming")
"""Camera motions; in two of five worlds it is on a tripod."""

BYSTANDER_NAMES = ("bystander", "other")
"""Moving bodies without a role in the task."""

MAX_DURATION_S = 15.0


@dataclass(frozen=True, slots=True)
class WorldKind:
    """A kind of machine at work.

    Attributes:
        name: Its name, such as `pick`.
        outcomes: The possible outcomes; the first is success.
        build: Makes a world from a random generator and an outcome.
    """

    name: str
    outcomes: tuple[str, ...]
    build: Callable[[np.random.Generator, str], World]


def random_view(
    rng: np.random.Generator, position: ArrayLike, aim: ArrayLike, frames: int
) -> Viewpoint:
    """A camera of random field of view at a position, with one of the motions of `CAMERA_MOTIONS`."""
    fov = float(rng.uniform(35, 43))
    return with_camera_motion(
        fixed_camera(position, aim, fov, frames), rng, str(rng.choice(CAMERA_MOTIONS))
    )


@dataclass(frozen=True, slots=True, eq=False)
class Script:
    """The scripted part of a world; the rest is drawn when it is finished.

    Attributes:
        bodies: Its static and moving bodies.
        view: The camera.
        task: Name of the task file and its text.
        actors: Actors of the task, with the names of their bodies.
        truth: Ground truth.
        frames: Number of frames.
        water: The water, if there is any.
    """

    bodies: Sequence[RigidBody]
    view: Viewpoint
    task: tuple[str, str]
    actors: tuple[str, ...]
    truth: TaskTruth
    frames: int
    water: Water | None = None


def complete_world(rng: np.random.Generator, kind: str, script: Script) -> World:
    """The world of a script, with light, sky and camera flaws."""
    light = random_light(rng, np.asarray(script.view.position))
    name, text = script.task
    if any(body.name in BYSTANDER_NAMES for body in script.bodies):
        # A user who expects bystanders declares them; otherwise alerts about them are correct.
        text += "bystanders ignored\n"
    return World(
        "",
        kind,
        tuple(script.bodies),
        script.view,
        light,
        random_sky(rng),
        random_sensor(rng, light),
        name,
        text,
        {a: a for a in script.actors},
        script.truth,
        script.frames,
        script.water,
        random_seed(rng),
    )


def random_camera_position(
    rng: np.random.Generator,
    aim: ArrayLike,
    distance: float,
    elevation_deg: tuple[float, float],
    max_azimuth: float = 0.6,
) -> NDArray[np.float64]:
    """(3,) position of a camera, on the side of -y.

    Args:
        rng: Random generator.
        aim: (3,) point it looks at, metres.
        distance: Distance to that point, metres.
        elevation_deg: Smallest and largest elevation, degrees.
        max_azimuth: Largest azimuth to either side, radians.
    """
    azimuth, elevation = (
        rng.uniform(-max_azimuth, max_azimuth),
        np.radians(rng.uniform(*elevation_deg)),
    )
    return np.asarray(aim, float) + distance * direction_from_angles(
        float(azimuth), float(elevation)
    )


def direction_from_angles(azimuth: float, elevation: float) -> NDArray[np.float64]:
    """(3,) unit, from the origin towards -y, rotated by an azimuth and an elevation, radians."""
    return np.array(
        [
            np.sin(azimuth) * np.cos(elevation),
            -np.cos(azimuth) * np.cos(elevation),
            np.sin(elevation),
        ]
    )


def truncated(truth: TaskTruth, end_s: float) -> TaskTruth:
    """The ground truth of a clip that ends before the task does, without errors.

    Args:
        truth: The complete ground truth.
        end_s: End of the clip.
    """
    started = [s for s in truth.stages if s.from_s < end_s]
    last = replace(started[-1], to_s=end_s)
    return replace(
        truth,
        verdict="in_progress",
        accept=("in_progress",),
        stages=(*started[:-1], last),
        contacts=tuple(
            replace(c, to_s=min(c.to_s, end_s)) for c in truth.contacts if c.from_s < end_s
        ),
        moves=tuple(replace(m, to_s=min(m.to_s, end_s)) for m in truth.moves if m.from_s < end_s),
    )


def stage_spans(
    *rows: tuple[str, float, float] | tuple[str, float, float, str],
) -> tuple[StageSpan, ...]:
    """Stages from rows of name, begin, end and, unless it is `complete`, outcome."""
    return tuple(StageSpan(r[0], float(r[1]), float(r[2]), *r[3:]) for r in rows)


def frames_until(seconds: float) -> int:
    """Number of frames of a clip that ends at a time, 15 s at most."""
    return int(min(seconds, MAX_DURATION_S) * FPS)

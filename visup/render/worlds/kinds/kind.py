"""A kind of world, and helpers shared by the builders."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from visup.render.worlds.things.scenery import random_heaven, random_imager, random_light, seed_of
from visup.render.worlds.viewpoint import disturbed, steady
from visup.render.worlds.world import FPS, Course, StageSpan, Thing, Viewpoint, Water, World

STYLES = ("fixed", "fixed", "shaking", "panning", "zooming")
"""Camera motions; in two of five worlds it is on a tripod."""

STRANGERS = ("bystander", "other")
"""Moving things without a role in the task."""

LONGEST_S = 15.0


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
    """A camera of random field of view at a position, with one of the motions of `STYLES`."""
    fov = float(rng.uniform(35, 43))
    return disturbed(steady(position, aim, fov, frames), rng, str(rng.choice(STYLES)))


@dataclass(frozen=True, slots=True, eq=False)
class Script:
    """The scripted part of a world; the rest is drawn when it is finished.

    Attributes:
        things: Its static and moving things.
        view: The camera.
        task: Name of the task file and its text.
        actors: Actors of the task, with the names of their things.
        course: Ground truth.
        frames: Number of frames.
        water: The water, if there is any.
    """

    things: Sequence[Thing]
    view: Viewpoint
    task: tuple[str, str]
    actors: tuple[str, ...]
    course: Course
    frames: int
    water: Water | None = None


def finished(rng: np.random.Generator, kind: str, script: Script) -> World:
    """The world of a script, with light, sky and camera flaws."""
    light = random_light(rng, np.asarray(script.view.position))
    name, text = script.task
    if any(thing.name in STRANGERS for thing in script.things):
        # A user who expects bystanders declares them; otherwise alerts about them are correct.
        text += "bystanders ignored\n"
    return World(
        "",
        kind,
        tuple(script.things),
        script.view,
        light,
        random_heaven(rng),
        random_imager(rng, light),
        name,
        text,
        {a: a for a in script.actors},
        script.course,
        script.frames,
        script.water,
        seed_of(rng),
    )


def from_around(
    rng: np.random.Generator,
    aim: ArrayLike,
    far: float,
    high_deg: tuple[float, float],
    side: float = 0.6,
) -> NDArray[np.float64]:
    """(3,) position of a camera, on the side of -y.

    Args:
        rng: Random generator.
        aim: (3,) point it looks at, metres.
        far: Distance to that point, metres.
        high_deg: Smallest and largest elevation, degrees.
        side: Largest azimuth to either side, radians.
    """
    turn, high = rng.uniform(-side, side), np.radians(rng.uniform(*high_deg))
    return np.asarray(aim, float) + far * bearing(float(turn), float(high))


def bearing(turn: float, high: float) -> NDArray[np.float64]:
    """(3,) unit, from the origin towards -y, rotated by an azimuth and an elevation, radians."""
    return np.array([np.sin(turn) * np.cos(high), -np.cos(turn) * np.cos(high), np.sin(high)])


def cut_short(course: Course, end_s: float) -> Course:
    """The course of a clip that ends before the task does, without errors.

    Args:
        course: The complete course.
        end_s: End of the clip.
    """
    begun = [s for s in course.stages if s.from_s < end_s]
    last = replace(begun[-1], to_s=end_s)
    return replace(
        course,
        verdict="in_progress",
        accept=("in_progress",),
        stages=(*begun[:-1], last),
        contacts=tuple(
            replace(c, to_s=min(c.to_s, end_s)) for c in course.contacts if c.from_s < end_s
        ),
        moves=tuple(replace(m, to_s=min(m.to_s, end_s)) for m in course.moves if m.from_s < end_s),
    )


def spans(*rows: tuple[str, float, float] | tuple[str, float, float, str]) -> tuple[StageSpan, ...]:
    """Stages from rows of name, begin, end and, unless it is `complete`, outcome."""
    return tuple(StageSpan(r[0], float(r[1]), float(r[2]), *r[3:]) for r in rows)


def frames_until(seconds: float) -> int:
    """Number of frames of a clip that ends at a time, 15 s at most."""
    return int(min(seconds, LONGEST_S) * FPS)

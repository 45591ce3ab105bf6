"""What a kind of world is, and what its builders share."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from visup.render.worlds.things.scenery import random_heaven, random_imager, random_light, seed_of
from visup.render.worlds.viewpoint import disturbed, steady
from visup.render.worlds.world import FPS, Course, StageSpan, Thing, Viewpoint, Water, World

STYLES = ("fixed", "fixed", "shaking", "panning", "zooming")
"""Ways to hold the camera, two of five on a tripod."""

STRANGERS = ("bystander", "other")
"""Things that move and have no part in the work."""

LONGEST_S = 15.0


@dataclass(frozen=True, slots=True)
class WorldKind:
    """A kind of machine at work.

    Attributes:
        name: Such as `pick`.
        outcomes: The ways it may go; the first is success.
        build: Makes a world from a generator and one of the outcomes.
    """

    name: str
    outcomes: tuple[str, ...]
    build: Callable[[np.random.Generator, str], World]


def random_view(
    rng: np.random.Generator, position: ArrayLike, aim: ArrayLike, frames: int
) -> Viewpoint:
    """A camera of random field of view at a place, held in one of the ways of `STYLES`."""
    fov = float(rng.uniform(35, 43))
    return disturbed(steady(position, aim, fov, frames), rng, str(rng.choice(STYLES)))


@dataclass(frozen=True, slots=True, eq=False)
class Script:
    """What a kind scripts; the rest of a world is drawn when it is finished.

    Attributes:
        things: What stands and moves in it.
        view: The camera.
        task: Name of the task file and its text.
        actors: Of the task, named as their things are.
        course: What is true.
        frames: How many there are.
        water: If there is any.
    """

    things: Sequence[Thing]
    view: Viewpoint
    task: tuple[str, str]
    actors: tuple[str, ...]
    course: Course
    frames: int
    water: Water | None = None


def finished(rng: np.random.Generator, kind: str, script: Script) -> World:
    """The world of a script, with light, sky and the flaws of a camera."""
    light = random_light(rng, np.asarray(script.view.position))
    name, text = script.task
    if any(thing.name in STRANGERS for thing in script.things):
        # Who knows that others come by says so; whoever does not is right to be alarmed.
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
    """(3,) a place for a camera: on the side of -y, so far from what it looks at.

    Args:
        rng: Draws where.
        aim: (3,) what it looks at, metres.
        far: Metres.
        high_deg: Least and most elevation.
        side: Most radians to either side.
    """
    turn, high = rng.uniform(-side, side), np.radians(rng.uniform(*high_deg))
    return np.asarray(aim, float) + far * bearing(float(turn), float(high))


def bearing(turn: float, high: float) -> NDArray[np.float64]:
    """(3,) unit, from the origin towards -y, turned to the side and raised, radians."""
    return np.array([np.sin(turn) * np.cos(high), -np.cos(turn) * np.cos(high), np.sin(high)])


def cut_short(course: Course, end_s: float) -> Course:
    """A course of a clip that ends before the task does and in which nothing went wrong.

    Args:
        course: As it would have gone on.
        end_s: When the clip ends.
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
    """Frames of a clip that ends at a time, 15 s at most."""
    return int(min(seconds, LONGEST_S) * FPS)

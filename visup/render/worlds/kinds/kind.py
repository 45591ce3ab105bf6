"""What a kind of world is, and what its builders share."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from visup.render.worlds.viewpoint import disturbed, steady
from visup.render.worlds.world import FPS, Course, StageSpan, Viewpoint, World

STYLES = ("fixed", "fixed", "shaking", "panning", "zooming")
"""Ways to hold the camera, two of five on a tripod."""

TOLERANCE_S = 0.7
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
    rng: np.random.Generator,
    position: ArrayLike,
    aim: ArrayLike,
    fov_vertical_deg: float,
    frames: int,
) -> Viewpoint:
    """A camera held in one of the ways of `STYLES`."""
    style = str(rng.choice(STYLES))
    return disturbed(steady(position, aim, fov_vertical_deg, frames), rng, style)


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

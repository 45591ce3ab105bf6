"""Zones and distances on the floor, for tasks with a `ground`."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from visup.agent import ObjectBelief, Truth
from visup.rules.formula.truth import truth_if
from visup.rules.geometry.ground import (
    Floats,
    floor_gap,
    foot_points,
    homography,
    projected,
    standing_point,
)
from visup.rules.predicates.snapshot import Snapshot
from visup.rules.relations.zones import contains
from visup.tasks.grammar.nodes import Ground, ZoneDeclaration
from visup.tasks.grammar.units import value


def floor_map(ground: Ground | None) -> Floats | None:
    """(3, 3) homography from the image, pixels, to the floor, metres; or None."""
    if ground is None:
        return None
    return homography(ground.image, [(value(x), value(y)) for x, y in ground.floor])


def floor_polygon(zone: ZoneDeclaration, ground: Ground | None) -> NDArray[np.float64] | None:
    """(K, 2) a zone of the floor in image coordinates, pixels; None without a ground."""
    h = floor_map(ground)
    if h is None or not zone.floor:
        return None
    back: Floats = np.linalg.inv(h).astype(float)
    corners = projected([(value(x), value(y)) for x, y in zone.floor], back)
    return corners if np.isfinite(corners).all() else None


def stands_in(
    belief: ObjectBelief, polygon: NDArray[np.float64], question: str, frame_size: tuple[int, int]
) -> Truth:
    """Whether an object stands in a zone of the floor; unknown while its foot points are outside the image.

    Args:
        belief: The object.
        polygon: (K, 2) the zone in image coordinates.
        question: 'inside' (the middle of its foot points), 'reaching' (any of them), 'wholly_inside'.
        frame_size: (width, height) pixels.
    """
    feet = foot_points(belief.region, frame_size)
    if not len(feet):
        return Truth.UNKNOWN
    points = standing_point(feet)[None] if question == "inside" else feet
    within = contains(points, polygon)
    return truth_if(bool(within.all() if question == "wholly_inside" else within.any()))


def floor_distance(ground: Ground | None) -> Callable[[Snapshot, tuple[int, ...]], float]:
    """The distance of two objects on the floor, metres; NaN if not known."""
    h = floor_map(ground)

    def measure(facts: Snapshot, rows: tuple[int, ...]) -> float:
        one, other = (facts.beliefs[r] for r in rows)
        if h is None:
            return float("nan")
        return floor_gap(one.region, other.region, facts.mind.frame_size, h)

    return measure

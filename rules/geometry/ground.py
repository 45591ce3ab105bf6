"""Ground plane: positions of objects on the floor, from image points of known floor position.

A plane and its image are related by a homography, which four points determine unless three are collinear. A
body stands at the lowest part of its outline.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from visup.agent.model.records import Region

Floats = NDArray[np.float64]
Points = Sequence[tuple[float, float]]

FOOT_SHARE = 0.15
"""Points this near to the lowest one, as a share of a body's height, are its foot points."""

MIN_SPREAD = 1e-6
"""Relative area of triangles below which points are collinear."""


def homography(source: Points, target: Points) -> Floats | None:
    """The projective map from some points to others, in the least-squares sense.

    Args:
        source: (N, 2), N at least 4.
        target: (N, 2).

    Returns:
        (3, 3); None when three of four points are collinear.

    Example:
        >>> square = [(0, 0), (1, 0), (1, 1), (0, 1)]
        >>> h = homography([(0, 0), (10, 0), (8, 10), (2, 10)], square)
        >>> projected([(5, 0), (5, 10)], h).round(6).tolist()
        [[0.5, 0.0], [0.5, 1.0]]
    """
    if len(source) < 4 or _in_line(source) or _in_line(target):
        return None
    (a, from_unit), (b, to_unit) = _normalised(source), _normalised(target)
    one, none = np.ones(len(a)), np.zeros((len(a), 3))
    plain = np.column_stack((a, one))
    above = np.column_stack((plain, none, -b[:, :1] * plain))
    below = np.column_stack((none, plain, -b[:, 1:] * plain))
    h = np.linalg.svd(np.vstack((above, below)))[2][-1].reshape(3, 3)
    found: Floats = np.linalg.inv(to_unit) @ h @ from_unit
    return found / found[2, 2] if abs(found[2, 2]) > 1e-12 else found


def projected(points: Points | Floats, h: Floats) -> Floats:
    """(N, 2) points mapped by a homography; NaN for those at or beyond the horizon."""
    given = np.asarray(points, dtype=float).reshape(-1, 2)
    mapped = np.column_stack((given, np.ones(len(given)))) @ h.T
    with np.errstate(divide="ignore", invalid="ignore"):
        out: Floats = mapped[:, :2] / np.where(mapped[:, 2:] == 0.0, np.nan, mapped[:, 2:])
    return out


def foot_points(region: Region, frame_size: tuple[int, int]) -> Floats:
    """Foot points of a body in the image: the lower edge of the lowest part of its outline.

    Args:
        region: The body.
        frame_size: (width, height) pixels.

    Returns:
        (N, 2) pixels, from left to right; empty when the lower border of the image cuts the body, so
        that its feet are invisible.
    """
    x, y, _, height = region.bbox
    if y + height >= frame_size[1] or not region.mask.any():
        return np.zeros((0, 2))
    columns = np.flatnonzero(region.mask.any(axis=0))
    lowest = height - 1 - np.argmax(region.mask[::-1, columns], axis=0)
    stands = lowest >= lowest.max() - max(1.0, FOOT_SHARE * height)
    return np.column_stack((x + columns[stands], y + lowest[stands])).astype(float)


def standing_point(feet: Floats) -> Floats:
    """(2,) the middle of a body's foot points."""
    middle: Floats = (feet.min(axis=0) + feet.max(axis=0)) / 2.0
    return middle


def floor_gap(one: Region, other: Region, frame_size: tuple[int, int], h: Floats) -> float:
    """Distance between two standing bodies, in floor units; NaN where feet are invisible.

    Args:
        one: A body.
        other: Another one.
        frame_size: (width, height) pixels.
        h: (3, 3) from the image to the floor.
    """
    feet = [projected(foot_points(r, frame_size), h) for r in (one, other)]
    if not all(len(f) for f in feet):
        return float("nan")
    apart = feet[0][:, None] - feet[1][None]
    return float(np.sqrt((apart * apart).sum(axis=2)).min())


def _in_line(points: Points) -> bool:
    """Whether any three of four points, or all of more, are collinear."""
    given = np.asarray(points, dtype=float)
    size = float(np.ptp(given, axis=0).max()) or 1.0
    if len(given) > 4:
        return bool(np.linalg.svd((given - given.mean(axis=0)) / size)[1][-1] < MIN_SPREAD)
    triples = ((0, 1, 2), (0, 1, 3), (0, 2, 3), (1, 2, 3))
    areas = [_area(*(given[k] / size for k in triple)) for triple in triples]
    return min(areas) < MIN_SPREAD


def _area(a: Floats, b: Floats, c: Floats) -> float:
    return abs(float((b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1]))) / 2.0


def _normalised(points: Points) -> tuple[Floats, Floats]:
    """Points centred and scaled to a mean distance of 1, and the map that does it."""
    given = np.asarray(points, dtype=float)
    middle = given.mean(axis=0)
    by = 1.0 / max(1e-12, float(np.linalg.norm(given - middle, axis=1).mean()))
    made = np.array([[by, 0, -by * middle[0]], [0, by, -by * middle[1]], [0, 0, 1.0]])
    return (given - middle) * by, made

"""How near outlines of regions are to each other, worked out once for each region and each pair.

In one step several thinkers ask about the same regions: who may hide a part of whom, who touches, who
is within whom. Regions never change, so that what was found of the most recent ones is remembered;
nothing but time hangs on that.
"""

from __future__ import annotations

from functools import cached_property, lru_cache

import numpy as np
from scipy.spatial import cKDTree

from visup.agent import Region
from visup.rules.geometry import Box, Floats, box_gap, dense, masks_overlap, outline

NEAR = 0.05
"""How near outlines must be for anybody to care how near they are, image diagonals."""

RECENT = 128
"""Regions that are remembered: those of two steps with fifty objects."""

ROUGHLY = 8
"""Each of so many points of an outline is looked at first."""

MOST_POINTS = 200
"""Points of an outline that are measured against another one."""


class Outline:
    """An outline made ready for looking up what is nearest to a point.

    Args:
        region: Any region.

    Attributes:
        points: (N, 2) pixels; see `outline`.
    """

    def __init__(self, region: Region) -> None:
        self.points = outline(region)

    @cached_property
    def closed(self) -> Floats:
        """(M, 2) points without wide gaps between neighbours; see `dense`."""
        return dense(self.points)

    @cached_property
    def tree(self) -> cKDTree:
        """Of `points`."""
        return cKDTree(self.points)

    @cached_property
    def closed_tree(self) -> cKDTree:
        """Of `closed`."""
        return self.tree if self.closed is self.points else cKDTree(self.closed)


@lru_cache(maxsize=RECENT)
def ready(region: Region) -> Outline:
    """The outline of a region, made ready."""
    return Outline(region)


def outline_gap(a: Region, b: Region, near: float) -> float | None:
    """Least distance between two outlines, when it is at most `near`.

    Args:
        a: One region.
        b: Another.
        near: Distance beyond which nobody cares, pixels.

    Returns:
        Pixels, 0 where the masks overlap or the outlines are neighbours (1 pixel apart or less),
        or None when it is greater than `near`.
    """
    if box_gap(a.bbox, b.bbox) > near:
        return None
    return _gap(a, b, near) if a.id <= b.id else _gap(b, a, near)


@lru_cache(maxsize=8 * RECENT)
def _gap(a: Region, b: Region, near: float) -> float | None:
    points, tree = ready(a).points, ready(b).tree
    # No point is nearest that is farther from the other's box than a few of them are from the other.
    rough = float(tree.query(points[::ROUGHLY])[0].min())
    inside = _within(points, b.bbox, min(near, rough))
    if len(inside) == 0:
        # One may still lie deep within the other.
        return 0.0 if masks_overlap(a, b) else None
    distance = float(tree.query(inside)[0].min())
    if distance > 1.5 and masks_overlap(a, b):
        return 0.0
    gap = max(0.0, distance - 1.0)
    return gap if gap <= near else None


def _within(points: Floats, box: Box, margin: float) -> Floats:
    """The points that are in a box, or at most `margin` and a pixel from it."""
    x, y, w, h = box
    px, py = points.T
    inside = (px >= x - margin - 1) & (px <= x + w + margin)
    inside &= (py >= y - margin - 1) & (py <= y + h + margin)
    found: Floats = points[inside]
    return found


def signed_distances(a: Region, b: Region) -> tuple[float, float]:
    """How far the outline of one region lies outside another, nearest and farthest point.

    Args:
        a: A region; of its outline at most `MOST_POINTS` points are looked at.
        b: Another.

    Returns:
        The least and the greatest distance of a's points to b's outline, pixels, negative within b.
    """
    points = ready(a).closed
    points = points[:: -(-len(points) // MOST_POINTS)]
    distance = np.asarray(ready(b).closed_tree.query(points)[0], dtype=float)
    x, y, w, h = b.bbox
    at = np.rint(points).astype(int) - (x, y)
    within = (at >= 0).all(axis=1) & (at[:, 0] < w) & (at[:, 1] < h)
    within[within] = b.mask[at[within, 1], at[within, 0]]
    signed = np.where(within, -distance, distance)
    return float(signed.min()), float(signed.max())

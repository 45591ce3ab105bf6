"""How far outlines reach and how near they are to each other, worked out once for each region and each pair.

In one step several reasoners ask about the same regions: who may hide a part of whom, who touches, who
is within whom. Regions never change, so that what was found of the most recent ones is remembered;
nothing but time hangs on that.
"""

from __future__ import annotations

from functools import cached_property, lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.agent import Region
from visup.rules.geometry._outlines_jit import (
    least_distance,
    longest_edge,
    outline_support,
    resampled,
    run_boxes,
    signed_extent,
)
from visup.rules.geometry.regions import (
    DIRECTIONS,
    Floats,
    box_gap,
    densified,
    masks_overlap,
    outline,
)

NEAR_SHARE = 0.05
"""How near outlines must be for anybody to care how near they are, image diagonals."""

CACHED_REGIONS = 128
"""Regions that are remembered: those of two steps with fifty objects."""

TEMPLATE_POINTS = 96
"""Least points of an outline that another one is laid upon."""

CLOSED_STEP = 2.0
"""Neighbouring points of an outline that are so near each other leave no gap, pixels."""

MOST_POINTS = 200
"""Points of an outline that are measured against another one."""


class PreparedOutline:
    """An outline made ready for looking up what is nearest to a point.

    Args:
        region: Any region.

    Attributes:
        points: (N, 2) pixels; see `outline`.
    """

    def __init__(self, region: Region) -> None:
        self._region = region
        self.points = outline(region)

    @cached_property
    def boxes(self) -> Floats:
        """Of the runs of `points`; see `_outlines_jit.py`."""
        return run_boxes(self.points)

    @cached_property
    def closed(self) -> Floats:
        """(M, 2) points without wide gaps between neighbours; see `densified`."""
        return (
            self.points
            if longest_edge(self.points) <= CLOSED_STEP
            else densified(self.points, CLOSED_STEP)
        )

    @cached_property
    def closed_boxes(self) -> Floats:
        """Of the runs of `closed`."""
        return self.boxes if self.closed is self.points else run_boxes(self.closed)

    @cached_property
    def even(self) -> Floats:
        """(M, 2) points evenly spaced, as many as it has, `TEMPLATE_POINTS` at least."""
        return resampled(self.points, max(TEMPLATE_POINTS, len(self.points)))

    @cached_property
    def even_boxes(self) -> Floats:
        """Of the runs of `even`."""
        return run_boxes(self.even)

    @cached_property
    def mask(self) -> NDArray[np.bool_]:
        """(h, w) of the region, in the one layout that loops are compiled for."""
        mask = self._region.mask
        plain = mask.flags.c_contiguous and mask.flags.writeable and mask.dtype == np.bool_
        return mask if plain else np.array(mask, dtype=np.bool_, order="C")

    @cached_property
    def hole_depth(self) -> NDArray[np.float32] | None:
        """(h, w) pixels from what lies in a hole to the region, 0 elsewhere; None without holes."""
        body = self.mask.astype(np.uint8)
        # A margin joins all that lies outside, so that one fill from a corner reaches it.
        outside = cv2.copyMakeBorder(1 - body, 1, 1, 1, 1, cv2.BORDER_CONSTANT, value=1)
        cv2.floodFill(outside, None, (0, 0), (0,))
        holes = outside[1:-1, 1:-1]
        if not holes.any():
            return None
        depth = cv2.distanceTransform(1 - body, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
        return np.asarray(depth * holes, dtype=np.float32)


@lru_cache(maxsize=CACHED_REGIONS)
def prepared_outline(region: Region) -> PreparedOutline:
    """The outline of a region, made ready."""
    return PreparedOutline(region)


def write_support(
    region: Region, frame_size: tuple[int, int], support: Floats, free: NDArray[np.bool_]
) -> None:
    """How far a region's outline reaches.

    Args:
        region: Any region.
        frame_size: (width, height), pixels.
        support: (16,) written, pixels: max over the outline of p . n for each of `DIRECTIONS`.
        free: (16,) written: whether the furthest point is clear of the image border, so that it
            belongs to the body and not to where the image ends.
    """
    outline_support(prepared_outline(region).points, DIRECTIONS, *frame_size, support, free)


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


@lru_cache(maxsize=8 * CACHED_REGIONS)
def _gap(a: Region, b: Region, near: float) -> float | None:
    # A pixel is as wide as 1: outlines of neighbours are so far apart.
    one, two = prepared_outline(a), prepared_outline(b)
    distance = least_distance(one.points, one.boxes, two.points, two.boxes, near + 1.0)
    # One may also lie deep within the other.
    if distance > 1.5 and masks_overlap(a, b):
        return 0.0
    gap = max(0.0, distance - 1.0)
    return gap if gap <= near else None


def signed_distances(a: Region, b: Region) -> tuple[float, float]:
    """How far one region lies outside another, nearest and farthest point.

    Args:
        a: A region; of its outline at most `MOST_POINTS` points are looked at, and what of it covers
            holes of the other, of which its outline tells nothing.
        b: Another.

    Returns:
        The least and the greatest distance of a's points to b's outline, pixels, negative within b.
    """
    points, body = prepared_outline(a).closed, prepared_outline(b)
    step = -(-len(points) // MOST_POINTS)
    x, y, _, _ = b.bbox
    least, most = signed_extent(points, step, body.closed, body.closed_boxes, body.mask, x, y)
    return least, max(most, _deepest_in_hole(a, b))


def _deepest_in_hole(a: Region, b: Region) -> float:
    """The farthest that a lies in a hole of b, pixels; minus infinity when it covers none."""
    depth = prepared_outline(b).hole_depth
    if depth is None:
        return -np.inf
    (ax, ay, aw, ah), (bx, by, bw, bh) = a.bbox, b.bbox
    left, top = max(ax, bx), max(ay, by)
    right, bottom = min(ax + aw, bx + bw), min(ay + ah, by + bh)
    if left >= right or top >= bottom:
        return -np.inf
    covers = a.mask[top - ay : bottom - ay, left - ax : right - ax]
    within = depth[top - by : bottom - by, left - bx : right - bx]
    deepest = float((within * covers).max())
    return deepest if deepest > 0.0 else -np.inf

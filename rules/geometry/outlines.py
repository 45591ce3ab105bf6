"""Cached support functions and distances of outlines, computed once per region and pair.

In one step several reasoners ask about the same regions: occlusion, contact, containment. Regions are
immutable, so results for the most recent ones are cached, which affects nothing but time.
"""

from __future__ import annotations

from functools import cached_property, lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.agent import Region
from visup.rules.geometry._outlines_jit import (
    least_distance,
    outline_support,
    run_boxes,
    signed_extent,
)
from visup.rules.geometry.regions import (
    DIRECTIONS,
    Floats,
    box_gap,
    masks_overlap,
)
from visup.rules.geometry.rings import closed_rings, concatenated, even_rings, rings

NEAR_SHARE = 0.05
"""Greatest gap that is computed exactly, image diagonals."""

CACHED_REGIONS = 128
"""Cached regions: those of two steps with fifty objects."""

TEMPLATE_POINTS = 96
"""Fewest points of an outline used as a registration target."""

CLOSED_STEP = 2.0
"""Spacing of points below which an outline counts as closed, pixels."""

MAX_POINTS = 200
"""Most points of an outline measured against another one."""


class PreparedOutline:
    """An outline prepared for nearest-point searches.

    Args:
        region: Any region.

    Attributes:
        rings: The outlines of its parts; see `rings.py`.
        points: (N, 2) all of their points, pixels.
    """

    def __init__(self, region: Region) -> None:
        self._region = region
        self.rings = rings(region)
        self.points = concatenated(self.rings)

    @cached_property
    def boxes(self) -> Floats:
        """Boxes of the runs of `points`; see `_outlines_jit.py`."""
        return run_boxes(self.points)

    @cached_property
    def closed(self) -> Floats:
        """(M, 2) points without wide gaps between neighbours; see `densified`."""
        return closed_rings(self.rings, CLOSED_STEP)

    @cached_property
    def closed_boxes(self) -> Floats:
        """Boxes of the runs of `closed`."""
        return self.boxes if self.closed is self.points else run_boxes(self.closed)

    @cached_property
    def even(self) -> Floats:
        """(M, 2) the outline resampled evenly, to at least `TEMPLATE_POINTS`."""
        return concatenated(even_rings(self.rings, max(TEMPLATE_POINTS, len(self.points))))

    @cached_property
    def even_boxes(self) -> Floats:
        """Boxes of the runs of `even`."""
        return run_boxes(self.even)

    @cached_property
    def mask(self) -> NDArray[np.bool_]:
        """(h, w) mask of the region, in the memory layout that loops are compiled for."""
        mask = self._region.mask
        plain = mask.flags.c_contiguous and mask.flags.writeable and mask.dtype == np.bool_
        return mask if plain else np.array(mask, dtype=np.bool_, order="C")

    @cached_property
    def hole_depth(self) -> NDArray[np.float32] | None:
        """(h, w) distance from points in holes to the region, pixels, 0 elsewhere; None without holes."""
        body = self.mask.astype(np.uint8)
        # A margin connects the outside, so that one fill from a corner reaches it all.
        outside = cv2.copyMakeBorder(1 - body, 1, 1, 1, 1, cv2.BORDER_CONSTANT, value=1)
        cv2.floodFill(outside, None, (0, 0), (0,))
        holes = outside[1:-1, 1:-1]
        if not holes.any():
            return None
        depth = cv2.distanceTransform(1 - body, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
        return np.asarray(depth * holes, dtype=np.float32)


@lru_cache(maxsize=CACHED_REGIONS)
def prepared_outline(region: Region) -> PreparedOutline:
    """The prepared outline of a region, cached."""
    return PreparedOutline(region)


def write_support(
    region: Region, frame_size: tuple[int, int], support: Floats, free: NDArray[np.bool_]
) -> None:
    """Write the support function of a region's outline.

    Args:
        region: Any region.
        frame_size: (width, height), pixels.
        support: (16,) output, pixels: max over the outline of p . n for each of `DIRECTIONS`.
        free: (16,) output: whether the farthest point is clear of the image border, so that it
            belongs to the body and not to where the image ends.
    """
    outline_support(prepared_outline(region).points, DIRECTIONS, *frame_size, support, free)


def outline_gap(a: Region, b: Region, near: float) -> float | None:
    """Least distance between two outlines, when it is at most `near`.

    Args:
        a: One region.
        b: Another.
        near: Greatest distance of interest, pixels.

    Returns:
        Pixels, 0 where the masks overlap or the outlines are neighbours (1 pixel apart or less),
        or None when it is greater than `near`. What lies in a hole of the other, as a part does in the
        box that it was put in, is as near as the rim of the hole.
    """
    if box_gap(a.bbox, b.bbox) > near:
        return None
    return _gap(a, b, near) if a.id <= b.id else _gap(b, a, near)


@lru_cache(maxsize=8 * CACHED_REGIONS)
def _gap(a: Region, b: Region, near: float) -> float | None:
    # Outlines of adjacent regions are one pixel apart.
    one, two = prepared_outline(a), prepared_outline(b)
    distance = least_distance(one.points, one.boxes, two.points, two.boxes, near + 1.0)
    # One may also be deep inside the other, or in a hole of it.
    if distance > 1.5:
        if masks_overlap(a, b):
            return 0.0
        distance = min(distance, _least_in_hole(a, b), _least_in_hole(b, a))
    gap = max(0.0, distance - 1.0)
    return gap if gap <= near else None


def signed_distances(a: Region, b: Region) -> tuple[float, float]:
    """Signed distances of a region to another, nearest and farthest point.

    Args:
        a: A region; at most `MAX_POINTS` points of its outline are used, and its part inside holes
            of the other, which the outline misses.
        b: Another.

    Returns:
        The least and the greatest distance of a's points to b's outline, pixels, negative inside b.
    """
    points, body = prepared_outline(a).closed, prepared_outline(b)
    step = -(-len(points) // MAX_POINTS)
    x, y, _, _ = b.bbox
    least, most = signed_extent(points, step, body.closed, body.closed_boxes, body.mask, x, y)
    return least, max(most, _deepest_in_hole(a, b))


def _deepest_in_hole(a: Region, b: Region) -> float:
    """Greatest depth of a in a hole of b, pixels; minus infinity when it covers none."""
    depths = _depths_in_hole(a, b)
    return float(depths.max()) if len(depths) else -np.inf


def _least_in_hole(a: Region, b: Region) -> float:
    """Least distance of a to the rim of a hole of b that it is in, pixels; infinite when in none."""
    depths = _depths_in_hole(a, b)
    return float(depths.min()) if len(depths) else np.inf


def _depths_in_hole(a: Region, b: Region) -> NDArray[np.float32]:
    """(N,) distances to b of the pixels of a that lie in a hole of b, pixels."""
    (ax, ay, aw, ah), (bx, by, bw, bh) = a.bbox, b.bbox
    left, top = max(ax, bx), max(ay, by)
    right, bottom = min(ax + aw, bx + bw), min(ay + ah, by + bh)
    depth = prepared_outline(b).hole_depth if left < right and top < bottom else None
    if depth is None:
        return np.empty(0, dtype=np.float32)
    covers = a.mask[top - ay : bottom - ay, left - ax : right - ax]
    within = depth[top - by : bottom - by, left - bx : right - bx][covers]
    return within[within > 0.0]

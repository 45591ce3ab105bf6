"""Whether one region keeps its shape: a body that is rigid does, two that only touch do not."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation

from visup.agent import Region

Mask = NDArray[np.bool_]


def shape_change(before: Region, after: Region, band: int = 2, search: int = 4) -> float:
    """How much of a region's shape changed, whatever its motion in the image plane.

    The two masks are laid over each other by their centroids and a search around that; pixels of
    either that lie more than `band` outside the other count. Turning counts as change: 0.6 degrees
    in a second move the end of a body of 200 px by 2 px.

    Args:
        before: A region.
        after: The same region later.
        band: Width of the band along the outline in which differences are noise, pixels.
        search: Half width of the search, pixels; every other shift is tried.

    Returns:
        Share of the later region's area, 0 to 2.
    """
    dx = after.centroid[0] - before.centroid[0]
    dy = after.centroid[1] - before.centroid[1]
    margin = band + search + 1
    shift = (round(dx), round(dy))
    size, at_before, at_after = _canvas(before, after, shift, margin)
    old, new = _laid(before, size, at_before), _laid(after, size, at_after)
    wide_old, wide_new = _grown(old, band), _grown(new, band)
    least = min(
        _difference(old, wide_old, new, wide_new, x, y)
        for x in range(-search, search + 1, 2)
        for y in range(-search, search + 1, 2)
    )
    return least / max(after.area, 1.0)


def _canvas(
    before: Region, after: Region, shift: tuple[int, int], margin: int
) -> tuple[tuple[int, int], tuple[int, int], tuple[int, int]]:
    bx, by = before.bbox[0] + shift[0], before.bbox[1] + shift[1]
    ax, ay = after.bbox[0], after.bbox[1]
    x0, y0 = min(bx, ax) - margin, min(by, ay) - margin
    x1 = max(bx + before.bbox[2], ax + after.bbox[2]) + margin
    y1 = max(by + before.bbox[3], ay + after.bbox[3]) + margin
    return (y1 - y0, x1 - x0), (by - y0, bx - x0), (ay - y0, ax - x0)


def _laid(region: Region, size: tuple[int, int], at: tuple[int, int]) -> Mask:
    out = np.zeros(size, dtype=bool)
    h, w = region.mask.shape
    out[at[0] : at[0] + h, at[1] : at[1] + w] = region.mask
    return out


def _grown(mask: Mask, by: int) -> Mask:
    grown: Mask = binary_dilation(mask, np.ones((3, 3), bool), iterations=by)
    return grown


def _difference(old: Mask, wide_old: Mask, new: Mask, wide_new: Mask, x: int, y: int) -> int:
    shifted, wide = np.roll(old, (y, x), (0, 1)), np.roll(wide_old, (y, x), (0, 1))
    return int(np.count_nonzero(shifted & ~wide_new) + np.count_nonzero(new & ~wide))

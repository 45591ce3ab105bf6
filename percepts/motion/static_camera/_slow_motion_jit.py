"""Compiled loops of `slow_motion`."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from visup.compiled import compiled
from visup.percepts.motion.features.work_image import Floats

Mask = NDArray[np.bool_]


@compiled
def squared_difference(
    now: NDArray[np.uint8], old: NDArray[np.uint8], exposure: np.float32
) -> Floats:
    """Squared difference of two (h, w) images, the older one multiplied by `exposure`, (h, w) float32."""
    out = np.empty(now.shape, np.float32)
    for y in range(now.shape[0]):
        for x in range(now.shape[1]):
            gap = np.float32(now[y, x]) - np.float32(old[y, x]) * exposure
            out[y, x] = gap * gap
    return out


@compiled
def update_ground_belief(
    share: Floats, was_hidden: Mask, hidden: Mask, pace: tuple[np.float32, np.float32]
) -> None:
    """Update, in place, the belief that no object hides the ground.

    Args:
        share: (h, w) the belief, 0 to 1; updated.
        was_hidden: (h, w) where the ground was ever hidden; updated.
        hidden: (h, w) where it is hidden in this frame.
        pace: Growth of the belief per frame where the ground was hidden before, and where it never was.
    """
    fast, slow = pace
    for y in range(share.shape[0]):
        for x in range(share.shape[1]):
            was_hidden[y, x] |= hidden[y, x]
            grown = min(share[y, x] + (fast if was_hidden[y, x] else slow), np.float32(1))
            share[y, x] = np.float32(0) if hidden[y, x] else grown


@compiled
def closing(mask: Mask, widths: NDArray[np.uint8]) -> Mask:
    """Morphological closing of a mask by a symmetric, convex kernel of at most 509 pixels a side.

    Beyond the mask there is nothing. Each row of the kernel is compared with the distance to the nearest
    pixel in a row of the mask, which takes time in proportion to the height of the kernel, not to its area.

    Args:
        mask: (h, w).
        widths: (reach + 1,) half width of the kernel's row at each distance from its middle row, pixels; the
            first is the largest.

    Returns:
        (h, w).
    """
    reach = len(widths) - 1
    height, width = mask.shape
    side = np.int64(widths[0])
    padded = np.zeros((height + 2 * reach, width + 2 * side), np.bool_)
    padded[reach : reach + height, side : side + width] = mask
    grown = _dilation(padded, widths)
    return ~_dilation(~grown, widths)[reach : reach + height, side : side + width]


@compiled
def _dilation(mask: Mask, widths: NDArray[np.uint8]) -> Mask:
    away, reach = _row_distances(mask), len(widths) - 1
    height = mask.shape[0]
    out = np.zeros(mask.shape, np.bool_)
    for y in range(height):
        here = out[y]
        for other in range(max(y - reach, 0), min(y + reach + 1, height)):
            row, near = away[other], widths[abs(other - y)]
            for x in range(len(here)):
                here[x] |= row[x] <= near
    return out


@compiled
def _row_distances(mask: Mask) -> NDArray[np.uint8]:
    """(h, w) uint8: distance of each pixel to the nearest one of its row in the mask, pixels; at most 255."""
    out = np.full(mask.shape, np.uint8(255))
    height, width = mask.shape
    for y in range(height):
        near = 255
        for x in range(width):
            near = 0 if mask[y, x] else min(near + 1, 255)
            out[y, x] = near
        near = 255
        for x in range(width - 1, -1, -1):
            near = 0 if mask[y, x] else min(near + 1, 255)
            out[y, x] = min(int(out[y, x]), near)
    return out

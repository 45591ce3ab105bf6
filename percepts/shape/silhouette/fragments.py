"""Joining of silhouette fragments: nearby islands are bridged, specks dropped.

Segmentation breaks thin limbs. Where the largest part does not hold nearly all of a mask, gaps are bridged:
the mask is closed by the smallest disc that joins nearly all of it, and only the bridges of the closing are
kept, so that bays and gaps within a part stay as they were.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

SUFFICIENT_SHARE = 0.98
"""Connected share of the mask from which gaps are not bridged."""

CLOSING_RADII = (0.015, 0.03, 0.06, 0.1)
"""Radii of the closing discs that are tried, in units of the square root of the area."""

_MAX_ISLANDS = 2000


def join_fragments(mask: NDArray[np.uint8]) -> NDArray[np.bool_]:
    """The largest part of a mask, with the islands near enough to be bridged.

    Args:
        mask: (H, W) uint8, 0 or 1.

    Returns:
        (H, W) bool, one 8-connected part; empty when the mask is.

    Example:
        >>> broken = np.zeros((30, 60), dtype=np.uint8)
        >>> broken[5:25, 5:25] = broken[12:16, 26:50] = 1
        >>> bridged = join_fragments(broken)
        >>> bool(bridged[13, 25]), bool(bridged[2, 25]), int(bridged.sum())
        (True, False, 502)
    """
    largest, share, islands = _largest(mask, mask)
    if share >= SUFFICIENT_SHARE or not 1 < islands <= _MAX_ISLANDS:
        return largest
    side = float(np.count_nonzero(mask)) ** 0.5
    outside = _distance(1 - mask, int(np.ceil(CLOSING_RADII[-1] * side)) + 2)
    hull = largest
    for reach in CLOSING_RADII:
        hull, share, _ = _largest(_closed(mask, outside, reach * side), mask)
        if share >= SUFFICIENT_SHARE:
            break
    return _bridged(mask.astype(bool) & hull, hull)


def _largest(
    whole: NDArray[np.uint8], counted: NDArray[np.uint8]
) -> tuple[NDArray[np.bool_], float, int]:
    """The part of a mask with most of the counted pixels, its share of them, and the number of parts."""
    count, labels = cv2.connectedComponents(whole, connectivity=8)
    if count <= 1:
        return np.zeros(whole.shape, dtype=bool), 0.0, 0
    inside = np.bincount(labels[counted > 0], minlength=count)
    inside[0] = 0
    best = int(np.argmax(inside))
    return (
        np.asarray(labels == best),
        float(inside[best]) / max(1, int(inside.sum())),
        count - 1,
    )


def _distance(of: NDArray[np.uint8], margin: int) -> NDArray[np.float32]:
    """Distance of each set pixel to the nearest unset one, with a margin of set pixels."""
    padded = np.pad(of, margin, constant_values=1)
    return np.asarray(cv2.distanceTransform(padded, cv2.DIST_L2, 5), dtype=np.float32)


def _closed(
    mask: NDArray[np.uint8], outside: NDArray[np.float32], reach: float
) -> NDArray[np.uint8]:
    """The mask closed by a disc (dilated, then eroded)."""
    grown = np.asarray(outside <= reach, dtype=np.uint8)
    shrunk = cv2.distanceTransform(grown, cv2.DIST_L2, 5) > reach
    margin = (outside.shape[0] - mask.shape[0]) // 2
    inner = shrunk[margin : margin + mask.shape[0], margin : margin + mask.shape[1]]
    return np.asarray(inner | (mask > 0), dtype=np.uint8)


def _bridged(own: NDArray[np.bool_], hull: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """The islands and the pieces of the hull between them that touch at least two."""
    count, islands = cv2.connectedComponents(own.astype(np.uint8), connectivity=8)
    if count <= 2:
        return own
    numbers = islands.astype(np.float32)
    near = np.ones((3, 3), dtype=np.uint8)
    highest = cv2.dilate(numbers, near)
    lowest = count - cv2.dilate(np.where(own, count - numbers, 0), near)
    pieces, gaps = cv2.connectedComponents((hull & ~own).astype(np.uint8), connectivity=8)
    numbers_of_gaps = np.arange(pieces)
    most = np.asarray(ndimage.maximum(highest, gaps, numbers_of_gaps))
    least = np.asarray(ndimage.minimum(np.where(lowest > 0, lowest, count), gaps, numbers_of_gaps))
    bridges = most > least
    bridges[0] = False
    return np.asarray(own | bridges[gaps])

"""Loops over the pixels of masks and the points of contours, for `codec.py`: see `visup/compiled.py`."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from visup.compiled import compiled

LARGEST = 2.0**24
"""float32 represents all smaller integers exactly."""
NO_DIGIT = 9  # the same as in mask_codec.py, which imports this file only on demand


@compiled
def run_lengths(mask: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Run lengths of a mask in reading order, beginning with False (0 if there is none).

    Args:
        mask: (N,) bool, contiguous.
    """
    count = 1
    for k in range(1, mask.size):
        count += mask[k] != mask[k - 1]
    first = 1 if mask.size and mask[0] else 0
    lengths = np.zeros(first + count, np.int64)
    at = first
    for k in range(mask.size):
        if k and mask[k] != mask[k - 1]:
            at += 1
        lengths[at] += 1
    return lengths


@compiled
def chain_digits(points: NDArray[np.float32], code: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """The moves of a contour from pixel to neighbouring pixel as digits.

    Args:
        points: (N, 2) pixels, contiguous, N > 0.
        code: (9,) character of a move (dx, dy) at 3 (dx + 1) + dy + 1; `NO_DIGIT` where there is no move.

    Returns:
        (N - 1,) characters; or (N,), all `NO_DIGIT`, for any other contour: with points that are not integers
        (or negative zeros), or with other moves.
    """
    count = len(points)
    found = np.full(count, NO_DIGIT, np.uint8)
    for k in range(count):
        for axis in range(2):
            x = points[k, axis]
            if not -LARGEST < x < LARGEST or x != np.floor(x) or (x == 0.0 and np.signbit(x)):
                return np.full(count, NO_DIGIT, np.uint8)
        if k:
            dx, dy = points[k, 0] - points[k - 1, 0], points[k, 1] - points[k - 1, 1]
            if not (-1.0 <= dx <= 1.0 and -1.0 <= dy <= 1.0) or (dx == 0.0 and dy == 0.0):
                return np.full(count, NO_DIGIT, np.uint8)
            found[k - 1] = code[3 * (int(dx) + 1) + int(dy) + 1]
    return found[: count - 1]


@compiled
def chain_points(
    x: int, y: int, digits: NDArray[np.uint8], moves: NDArray[np.int64]
) -> NDArray[np.float32]:
    """The contour of a chain code.

    Args:
        x: Of its first point, pixels.
        y: The same.
        digits: (N,) numbers of moves, all below 8.
        moves: (8, 2) pixels.

    Returns:
        (N + 1, 2) pixels.
    """
    points = np.empty((len(digits) + 1, 2), np.float32)
    points[0, 0], points[0, 1] = x, y
    for k in range(len(digits)):
        x += moves[digits[k], 0]
        y += moves[digits[k], 1]
        points[k + 1, 0], points[k + 1, 1] = x, y
    return points

"""Compiled loops of `motion_constraints`: strongest gradients and structure tensors."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from visup.compiled import compiled
from visup.percepts.motion.features.work_image import Floats

Ints = NDArray[np.int64]


@compiled
def strongest_gradients(
    gx: Floats, gy: Floats, cell: int, margin: int
) -> tuple[Ints, Ints, Floats]:
    """The position of the strongest gradient in each square of an image.

    Args:
        gx: (h, w) float32.
        gy: (h, w) float32.
        cell: Side of the squares, pixels.
        margin: Pixels at the border of the image that are skipped.

    Returns:
        (N,) columns, (N,) rows, and (N,) float32 squared gradients, square by square; 0 in squares
        without a gradient.
    """
    height, width = gx.shape
    rows, cols = height // cell, width // cell
    xs, ys = np.zeros(rows * cols, np.int64), np.zeros(rows * cols, np.int64)
    values = np.zeros(rows * cols, np.float32)
    for n in range(rows * cols):
        top, left = n // cols * cell, n % cols * cell
        ys[n], xs[n] = top, left
        for y in range(max(top, margin), min(top + cell, height - margin)):
            for x in range(max(left, margin), min(left + cell, width - margin)):
                value = gx[y, x] * gx[y, x] + gy[y, x] * gy[y, x]
                if value > values[n]:
                    values[n], ys[n], xs[n] = value, y, x
    return xs, ys, values


@compiled
def structure_tensors(gx: Floats, gy: Floats, xs: Ints, ys: Ints, window: int) -> Floats:
    """Structure tensors summed over windows; the image is mirrored at its border.

    Args:
        gx: (h, w) float32.
        gy: (h, w) float32.
        xs: (N,) columns of the middles.
        ys: (N,) rows of the middles.
        window: Side of a window, odd.

    Returns:
        (N, 3) float32 (xx, xy, yy).
    """
    height, width = gx.shape
    half = window // 2
    out = np.empty((len(xs), 3), np.float32)
    for n in range(len(xs)):
        xx, xy, yy = 0.0, 0.0, 0.0
        for v in range(ys[n] - half, ys[n] + half + 1):
            y = min(abs(v), 2 * (height - 1) - abs(v))
            for u in range(xs[n] - half, xs[n] + half + 1):
                x = min(abs(u), 2 * (width - 1) - abs(u))
                a, b = float(gx[y, x]), float(gy[y, x])
                xx, xy, yy = xx + a * a, xy + a * b, yy + b * b
        out[n, 0], out[n, 1], out[n, 2] = xx, xy, yy
    return out

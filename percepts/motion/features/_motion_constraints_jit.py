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
        best, at_x, at_y = np.float32(0), left, top
        for y in range(max(top, margin), min(top + cell, height - margin)):
            for x in range(max(left, margin), min(left + cell, width - margin)):
                value = gx[y, x] * gx[y, x] + gy[y, x] * gy[y, x]
                if value > best:
                    best, at_x, at_y = value, x, y
        values[n], xs[n], ys[n] = best, at_x, at_y
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
    # Column by column: sums along a row would have to wait for each other.
    sums = np.empty((3, window))
    for n in range(len(xs)):
        left, top = xs[n] - half, ys[n] - half
        sums[:] = 0.0
        if min(left, top) >= 0 and left + window <= width and top + window <= height:
            along = gx[top : top + window, left : left + window]
            down = gy[top : top + window, left : left + window]
            for v in range(window):
                for u in range(window):
                    a, b = float(along[v, u]), float(down[v, u])
                    sums[0, u] += a * a
                    sums[1, u] += a * b
                    sums[2, u] += b * b
        else:
            for v in range(top, top + window):
                y = min(abs(v), 2 * (height - 1) - abs(v))
                for u in range(window):
                    x = min(abs(left + u), 2 * (width - 1) - abs(left + u))
                    a, b = float(gx[y, x]), float(gy[y, x])
                    sums[0, u] += a * a
                    sums[1, u] += a * b
                    sums[2, u] += b * b
        for k in range(3):
            out[n, k] = sums[k].sum()
    return out


@compiled
def inverse_covariances(tensor: Floats, sigma: Floats, floor: float) -> Floats:
    """As `information_of`."""
    out = np.empty((len(tensor), 3), np.float32)
    for n in range(len(tensor)):
        xx, xy, yy = float(tensor[n, 0]), float(tensor[n, 1]), float(tensor[n, 2])
        mean, apart = (xx + yy) / 2, (xx - yy) / 2
        half = np.sqrt(apart * apart + xy * xy)
        variance = float(sigma[n]) ** 2
        strong = 1 / (variance / max(mean + half, 1e-6) + floor**2)
        weak = 1 / (variance / max(mean - half, 1e-6) + floor**2)
        # Along the strong direction: its doubled angle has the cosine and sine of (apart, xy) / half.
        cosine, sine = (apart / half, xy / half) if half > 0 else (1.0, 0.0)
        out[n, 0] = (strong * (1 + cosine) + weak * (1 - cosine)) / 2
        out[n, 1] = (strong - weak) * sine / 2
        out[n, 2] = (strong * (1 - cosine) + weak * (1 + cosine)) / 2
    return out

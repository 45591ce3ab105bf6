"""The compiled loop of `point_search`: Lucas and Kanade's search for one point after another."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from visup.compiled import compiled
from visup.percepts.motion.features.work_image import Floats

Grey = NDArray[np.uint8]
WINDOW = 11
HALF = WINDOW // 2
LANES = 16  # a row of the window is as wide in memory: whole rows are computed at once
DAMPING = 1e-5  # of the tensor, as a share of its trace: only so that it can be inverted


@compiled
def search_nearby(
    source: tuple[Grey, Floats, Floats],
    target: Grey,
    start: Floats,
    begin: Floats,
    limits: tuple[int, float, float],
) -> tuple[Floats, NDArray[np.bool_], Floats]:
    """Positions at which the windows of points are found, where that is near to where they are expected.

    Args:
        source: The image of the points, (h, w), and its gradients along x and y.
        target: (h, w), the image to search.
        start: (N, 2) positions of the points in `source`, whole pixels.
        begin: (N, 2) positions at which they are expected in `target`.
        limits: Most iterations; the step, pixels, at which a search ends; how far from `begin`, pixels.

    Returns:
        (N, 2) positions in `target`; (N,) whether they were found, within the limits and both images;
        (N,) float32 mean difference of the windows, grey levels.
    """
    grey, gx, gy = source
    most, enough, reach = limits
    height, width = grey.shape
    end, found = begin.copy(), np.zeros(len(start), np.bool_)
    misfit = np.full(len(start), np.float32(255))
    own = np.zeros((3, WINDOW, LANES), np.float32)
    other = np.zeros((WINDOW + 1, LANES + 1), np.float32)
    sums = np.empty((3, LANES), np.float32)
    for n in range(len(start)):
        if not _is_inside(start[n, 0], start[n, 1], height, width):
            continue
        left, top = int(start[n, 0]) - HALF, int(start[n, 1]) - HALF
        tones = grey[top : top + WINDOW, left : left + WINDOW]
        along_x = gx[top : top + WINDOW, left : left + WINDOW]
        along_y = gy[top : top + WINDOW, left : left + WINDOW]
        for j in range(WINDOW):
            for i in range(WINDOW):
                own[0, j, i], own[1, j, i] = tones[j, i], along_x[j, i]
                own[2, j, i] = along_y[j, i]
        xx, xy, yy = _tensor(own, sums)
        damped = np.float32(DAMPING) * (xx + yy) + np.float32(1e-3)
        xx, yy = xx + damped, yy + damped
        area = xx * yy - xy * xy
        u, v = begin[n, 0], begin[n, 1]
        column, row = -1, -1
        for _ in range(most):
            if not _is_inside(u, v, height, width):
                break
            if int(u) != column or int(v) != row:
                column, row = int(u), int(v)
                part = target[row - HALF : row + HALF + 2, column - HALF : column + HALF + 2]
                for j in range(WINDOW + 1):
                    for i in range(WINDOW + 1):
                        other[j, i] = part[j, i]
            by_x, by_y, differs = _difference(own, other, u - column, v - row, sums)
            step_x, step_y = (xy * by_y - yy * by_x) / area, (xy * by_x - xx * by_y) / area
            misfit[n] = differs / np.float32(WINDOW * WINDOW)
            u, v = u + step_x, v + step_y
            if (u - begin[n, 0]) ** 2 + (v - begin[n, 1]) ** 2 > reach * reach:
                break
            if step_x * step_x + step_y * step_y < enough * enough:
                end[n, 0], end[n, 1], found[n] = u, v, _is_inside(u, v, height, width)
                break
    return end, found, misfit


@compiled
def _is_inside(x: float, y: float, height: int, width: int) -> bool:
    """Whether a window, and the pixels that interpolation needs, are in the image."""
    return bool(HALF <= x < width - HALF - 1 and HALF <= y < height - HALF - 1)


@compiled
def _tensor(own: Floats, sums: Floats) -> tuple[np.float32, np.float32, np.float32]:
    """The structure tensor (xx, xy, yy) of a window; `sums` is overwritten."""
    # Column by column, here and below: sums along a row would have to be added in its order, one by one.
    for k in range(3):
        for i in range(LANES):
            sums[k, i] = np.float32(0)
    for j in range(WINDOW):
        for i in range(LANES):
            sums[0, i] += own[1, j, i] * own[1, j, i]
            sums[1, i] += own[1, j, i] * own[2, j, i]
            sums[2, i] += own[2, j, i] * own[2, j, i]
    return _total(sums[0]), _total(sums[1]), _total(sums[2])


@compiled
def _difference(
    own: Floats, other: Floats, right: float, down: float, sums: Floats
) -> tuple[np.float32, np.float32, np.float32]:
    """How two windows differ: by the gradients along x and y, and absolutely; `sums` is overwritten.

    Args:
        own: (3, WINDOW, LANES) grey values and gradients of the point.
        other: (WINDOW + 1, LANES + 1) grey values of the other image.
        right: Position of the window in those, 0 to 1.
        down: The same along y.
        sums: (3, LANES).
    """
    one, a, b = np.float32(1), np.float32(right), np.float32(down)
    p, q, r, s = (one - a) * (one - b), a * (one - b), (one - a) * b, a * b
    for k in range(3):
        for i in range(LANES):
            sums[k, i] = np.float32(0)
    for j in range(WINDOW):
        for i in range(LANES):
            upper = p * other[j, i] + q * other[j, i + 1]
            off = upper + (r * other[j + 1, i] + s * other[j + 1, i + 1]) - own[0, j, i]
            sums[0, i] += off * own[1, j, i]
            sums[1, i] += off * own[2, j, i]
            sums[2, i] += abs(off)
    return _total(sums[0]), _total(sums[1]), _total(sums[2])


@compiled
def _total(values: Floats) -> np.float32:
    """The sum over the columns of a window."""
    total = np.float32(0)
    for i in range(WINDOW):
        total += values[i]
    return total

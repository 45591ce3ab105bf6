"""Compiled loop of `outline_motion`: pixels compared with where either side of an outline comes from."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from visup.compiled import compiled
from visup.percepts.motion.features.work_image import Floats

Places = NDArray[np.int32]
"""(N, 2) rows and columns of pixels."""


@compiled
def moved_log_odds(
    near: Places,
    now: tuple[NDArray[np.uint8], Floats, Floats],
    before: tuple[NDArray[np.uint8], tuple[int, int]],
    flows: tuple[Floats, Floats],
    limits: tuple[float, float, float, float],
) -> Floats:
    """Log odds, by the motion of either side, that pixels are inside, (N,) float32.

    Args:
        near: The pixels.
        now: (h, w) part of the newest image, and its gradients along x and y, grey levels per pixel.
        before: (H, W), the whole previous image, and the (x, y) of the part in it.
        flows: (h / 2, w / 2, 3) each: flow back inside and outside, and whether it is known there.
        limits: Standard deviations of grey levels and of displacements, most squared distance, most
            log odds.
    """
    noise, off, far, most = limits
    grey, along, down = now
    old, corner = before
    out = np.zeros(len(near), np.float32)
    for n in range(len(near)):
        y, x = near[n]
        v, u = y // 2, x // 2
        if flows[0][v, u, 2] <= 0 or flows[1][v, u, 2] <= 0:
            continue
        slope = along[y, x] ** 2 + down[y, x] ** 2
        sure = 1 / (noise**2 + off**2 * slope)
        odds = 0.0
        for k in range(2):
            from_x = x + corner[0] + flows[k][v, u, 0]
            from_y = y + corner[1] + flows[k][v, u, 1]
            gap = float(grey[y, x]) - sampled(old, from_x, from_y)
            odds += (0.5 if k else -0.5) * min(gap * gap * sure, far)
        out[n] = max(-most, min(most, odds))
    return out


@compiled
def carried_flow(flow: Floats, where: NDArray[np.uint8], reach: int, least: float) -> Floats:
    """Mean flow of some pixels in the window around each, and 1 where there are enough, (h, w, 3) float32.

    Sums are kept for each column and move down row by row, then along the row.

    Args:
        flow: (h, w, 2) float32.
        where: (h, w), 1 at the pixels that count, 0 elsewhere.
        reach: Half the side of the window, pixels.
        least: Pixels that the window must hold.
    """
    height, width = where.shape
    out = np.empty((height, width, 3), np.float32)
    columns = np.zeros((width, 3))
    for y in range(-reach, height):
        first, last = y - reach - 1, y + reach
        if last < height:
            for x in range(width):
                if where[last, x]:
                    columns[x, 0] += flow[last, x, 0]
                    columns[x, 1] += flow[last, x, 1]
                    columns[x, 2] += 1
        if first >= 0:
            for x in range(width):
                if where[first, x]:
                    columns[x, 0] -= flow[first, x, 0]
                    columns[x, 1] -= flow[first, x, 1]
                    columns[x, 2] -= 1
        if y < 0:
            continue
        along, down, count = 0.0, 0.0, 0.0
        for x in range(min(reach, width)):
            along, down, count = along + columns[x, 0], down + columns[x, 1], count + columns[x, 2]
        for x in range(width):
            if x + reach < width:
                new = columns[x + reach]
                along, down, count = along + new[0], down + new[1], count + new[2]
            if x > reach:
                old = columns[x - reach - 1]
                along, down, count = along - old[0], down - old[1], count - old[2]
            share = 1 / max(count, 1.0)
            out[y, x, 0], out[y, x, 1] = along * share, down * share
            out[y, x, 2] = 1 if count >= least else 0
    return out


@compiled
def sampled(image: NDArray[np.uint8], x: float, y: float) -> float:
    """An image between its pixels, bilinear; beyond it, its nearest pixel."""
    height, width = image.shape
    x, y = max(0.0, min(width - 1.0, x)), max(0.0, min(height - 1.0, y))
    # Unsigned: negative places would be counted from the end, and tested for.
    left, top, one = np.uint64(x), np.uint64(y), np.uint64(1)
    right, bottom = min(left + one, np.uint64(width - 1)), min(top + one, np.uint64(height - 1))
    p, q = x - np.float64(left), y - np.float64(top)
    above = (1 - p) * image[top, left] + p * image[top, right]
    below = (1 - p) * image[bottom, left] + p * image[bottom, right]
    return float((1 - q) * above + q * below)

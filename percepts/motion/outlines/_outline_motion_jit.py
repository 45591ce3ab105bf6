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
        spread = noise**2 + off**2 * slope
        odds = 0.0
        for k in range(2):
            from_x = x + corner[0] + flows[k][v, u, 0]
            from_y = y + corner[1] + flows[k][v, u, 1]
            gap = float(grey[y, x]) - sampled(old, from_x, from_y)
            odds += (0.5 if k else -0.5) * min(gap * gap / spread, far)
        out[n] = max(-most, min(most, odds))
    return out


@compiled
def sampled(image: NDArray[np.uint8], x: float, y: float) -> float:
    """An image between its pixels, bilinear; beyond it, its nearest pixel."""
    height, width = image.shape
    x, y = max(0.0, min(width - 1.0, x)), max(0.0, min(height - 1.0, y))
    left, top = int(x), int(y)
    right, bottom = min(left + 1, width - 1), min(top + 1, height - 1)
    p, q = x - left, y - top
    above = (1 - p) * image[top, left] + p * image[top, right]
    below = (1 - p) * image[bottom, left] + p * image[bottom, right]
    return float((1 - q) * above + q * below)

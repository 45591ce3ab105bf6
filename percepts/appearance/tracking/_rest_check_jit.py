"""Compiled loop of `segmentation`: comparison of pixels with remembered ones."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from visup.compiled import compiled

Bytes = NDArray[np.uint8]


@compiled
def unchanged_pixels(now: Bytes, was: Bytes, light: int, chroma: int) -> NDArray[np.bool_]:
    """Which pixels are unchanged except for lighting.

    A shadow darkens a pixel and moves its colour towards grey in proportion, but keeps its hue.

    Args:
        now: (h, w, 3) uint8, CIE Lab as OpenCV codes it.
        was: (h, w, 3) uint8, the same as remembered.
        light: Tolerance of lightness, steps.
        chroma: Tolerance of either colour, steps.

    Returns:
        (h, w) bool.
    """
    rows, cols = now.shape[:2]
    out = np.zeros((rows, cols), np.bool_)
    for y in range(rows):
        for x in range(cols):
            a, b = np.float32(now[y, x, 0]), np.float32(was[y, x, 0])
            near = (
                abs(a - b) <= light
                and abs(np.int32(now[y, x, 1]) - np.int32(was[y, x, 1])) <= chroma
                and abs(np.int32(now[y, x, 2]) - np.int32(was[y, x, 2])) <= chroma
            )
            if not near and b > 50:
                ratio = (a + np.float32(1)) / (b + np.float32(1))
                if 0.62 < ratio < 1.25:
                    green = (
                        np.float32(now[y, x, 1]) - 128 - (np.float32(was[y, x, 1]) - 128) * ratio
                    )
                    blue = np.float32(now[y, x, 2]) - 128 - (np.float32(was[y, x, 2]) - 128) * ratio
                    near = abs(green) <= chroma and abs(blue) <= chroma
            out[y, x] = near
    return out

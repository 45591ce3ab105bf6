"""Outlines drawn to where the tones change: each pixel beside one goes to the side that it resembles.

Cells are several pixels wide, and some lie across the border of an object: a dark sky, a gap
between legs. Along the outline the tones inside and outside are described by their mean and variance
in a window, and pixels there are given anew (after Lankton and Tannenbaum, Localizing region-based
active contours, 2008, with local Gaussians as Wang, He, Mishra and Li have them, 2009). Where both
sides look alike nothing changes.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.percepts.motion.image import Floats

WINDOW = 21  # pixels: side of the window whose tones are compared
BAND = 5  # pixels from the outline within which pixels may change sides
LEAST = 0.08  # share of the window that each side must fill
NOISE = 6.0  # least standard deviation of tones
STEEP = 0.7  # weight of the share that a pixel has already, per unit of log odds
MOST = 3.0  # log odds that tones may give to a pixel
CONTEXT = WINDOW // 2 + BAND
"""How much wider than the object a part of the image should be for it, pixels."""


def fitted(share: Floats, tone: NDArray[np.uint8]) -> Floats:
    """Shares after pixels near the outline have been given to the side that they resemble.

    Args:
        share: (h, w) float32 probability of an object.
        tone: (h, w, 3) uint8.

    Returns:
        (h, w) float32, on the sides of a half on which pixels are.
    """
    inside = (share > 0.5).view(np.uint8)
    full = np.asarray(cv2.boxFilter(inside, cv2.CV_32F, (WINDOW, WINDOW)), dtype=np.float32)
    kernel = np.ones((2 * BAND + 1, 2 * BAND + 1), np.uint8)
    beside = cv2.dilate(inside, kernel) != cv2.erode(inside, kernel)
    beside &= (full > LEAST) & (full < 1 - LEAST)
    at = np.flatnonzero(beside)
    if not len(at):
        return share
    odds = np.zeros(share.shape, dtype=np.float32)
    odds.ravel()[at] = _odds(inside, full.ravel()[at][:, None], tone, at)
    smooth = np.asarray(cv2.GaussianBlur(odds, (3, 3), 0.8), dtype=np.float32)
    known = np.clip(share.ravel()[at], 0.02, 0.98)
    both = smooth.ravel()[at] + STEEP * np.log(known / (1 - known))
    out = share.copy()
    out.ravel()[at] = 1 / (1 + np.exp(-both))
    return out


def _odds(
    inside: NDArray[np.uint8], full: Floats, tone: NDArray[np.uint8], at: NDArray[np.int64]
) -> Floats:
    """Log odds of some pixels to be inside, by their tone.

    Args:
        inside: (h, w), 1 inside of the object.
        full: (N, 1) float32, share of the window around each pixel that is inside.
        tone: (h, w, 3).
        at: (N,) places of the pixels in scan order.

    Returns:
        (N,) float32.
    """
    mine = cv2.bitwise_and(tone, tone, mask=inside)
    sums = [
        f(image, cv2.CV_32F, (WINDOW, WINDOW)).reshape(-1, 3)[at]
        for image in (mine, tone)
        for f in (cv2.boxFilter, cv2.sqrBoxFilter)
    ]
    own = tone.reshape(-1, 3)[at].astype(np.float32)
    away_in, wide_in = _away(own, sums[0] / full, sums[1] / full)
    rest = 1 - full
    away_out, wide_out = _away(own, (sums[2] - sums[0]) / rest, (sums[3] - sums[1]) / rest)
    width = np.log(np.prod(wide_out / wide_in, axis=1))
    # The three planes of a grey world tell the same.
    odds = 0.5 * ((away_out - away_in).sum(axis=1) + width) / 3
    return np.asarray(np.clip(odds, -MOST, MOST), dtype=np.float32)


def _away(own: Floats, mean: Floats, square: Floats) -> tuple[Floats, Floats]:
    """Squared distance of tones from a mean in standard deviations, and the variance, (N, 3)."""
    variance = np.asarray(np.maximum(square - mean * mean, 0) + NOISE**2, dtype=np.float32)
    gap = own - mean
    return np.asarray(gap * gap / variance, dtype=np.float32), variance

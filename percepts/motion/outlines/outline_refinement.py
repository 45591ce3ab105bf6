"""Outline refinement: pixels near an outline are reassigned to the side whose tones they resemble.

Cells are several pixels wide, and some lie across the border of an object: a dark sky, a gap between
legs. Along the outline, the tones inside and outside are described by local mean and variance, and
nearby pixels are reclassified (after Lankton and Tannenbaum, Localizing region-based active contours,
2008, with local Gaussians as in Wang, He, Mishra and Li, 2009). Where both sides look alike nothing
changes.
"""

from __future__ import annotations

from math import exp, log

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.compiled import compiled
from visup.percepts.motion.features.work_image import Floats

WINDOW = 21  # pixels: side of the window whose tones are compared
SAMPLED = (WINDOW // 2 + 1, WINDOW // 2 + 1)  # the same in the image at half the size
BAND = 5  # pixels from the outline within which pixels may change sides
LEAST = 0.08  # share of the window that each side must fill
NOISE = 6.0  # least standard deviation of tones
STEEP = 0.7  # weight of a pixel's prior share, per unit of log odds
MOST = 3.0  # log odds that tones may add to a pixel at most
CONTEXT = WINDOW // 2 + BAND
"""Margin around the object that a crop for refinement needs, pixels."""


def refine_outline(share: Floats, tone: NDArray[np.uint8]) -> Floats:
    """Shares after pixels near the outline were assigned to the side they resemble.

    Args:
        share: (h, w) float32 probability of an object.
        tone: (h, w, 3) uint8.

    Returns:
        (h, w) float32; above one half inside.
    """
    odds = inside_log_odds(share, tone)
    if not odds.any():
        return share
    return _with_odds(
        share, odds, np.asarray(cv2.GaussianBlur(odds, (3, 3), 0.8), dtype=np.float32)
    )


def inside_log_odds(share: Floats, tone: NDArray[np.uint8]) -> Floats:
    """Log odds of the pixels near an outline to be inside, by their tone.

    Args:
        share: (h, w) float32 probability of an object.
        tone: (h, w, 3) uint8.

    Returns:
        (h, w) float32; 0 away from the outline.
    """
    inside = (share > 0.5).view(np.uint8)
    kernel = np.ones((2 * BAND + 1, 2 * BAND + 1), np.uint8)
    near = cv2.dilate(inside, kernel) != cv2.erode(inside, kernel)
    # For means over a window, every other pixel is enough.
    some = np.ascontiguousarray(inside[::2, ::2])
    full = np.asarray(cv2.boxFilter(some, cv2.CV_32F, SAMPLED), dtype=np.float32)
    tones = np.ascontiguousarray(tone[::2, ::2])
    mine = np.asarray(cv2.bitwise_and(tones, tones, mask=some), dtype=np.uint8)
    return _odds(near, full, tone, _means(mine), _means(tones))


def _means(tones: NDArray[np.uint8]) -> tuple[Floats, Floats]:
    """Means of tones, and of their squares, in the window around each pixel."""
    return (
        np.asarray(cv2.boxFilter(tones, cv2.CV_32F, SAMPLED), dtype=np.float32),
        np.asarray(cv2.sqrBoxFilter(tones, cv2.CV_32F, SAMPLED), dtype=np.float32),
    )


@compiled
def _odds(
    near: NDArray[np.bool_],
    full: Floats,
    tone: NDArray[np.uint8],
    inside: tuple[Floats, Floats],
    all_: tuple[Floats, Floats],
) -> Floats:
    """Log odds, by tone, that pixels near an outline are inside, (h, w) float32; 0 elsewhere.

    Args:
        near: (h, w) bool, the pixels.
        full: (h / 2, w / 2) share of the window around each that is inside.
        tone: (h, w, 3).
        inside: (h / 2, w / 2, 3) means over the window of the tones inside, 0 taken for others, and
            of their squares.
        all_: The same of all tones.
    """
    mine, mine_squared = inside
    every, every_squared = all_
    out = np.zeros(near.shape, np.float32)
    for y in range(near.shape[0]):
        for x in range(near.shape[1]):
            v, u = y // 2, x // 2
            part = float(full[v, u])
            if not near[y, x] or part <= LEAST or part >= 1 - LEAST:
                continue
            away, wide = 0.0, 1.0
            for i in range(3):
                one, two = mine[v, u, i] / part, mine_squared[v, u, i] / part
                within = max(two - one * one, 0.0) + NOISE**2
                gap = tone[y, x, i] - one
                one = (every[v, u, i] - mine[v, u, i]) / (1 - part)
                two = (every_squared[v, u, i] - mine_squared[v, u, i]) / (1 - part)
                beyond = max(two - one * one, 0.0) + NOISE**2
                far = tone[y, x, i] - one
                away += far * far / beyond - gap * gap / within
                wide *= beyond / within
            # The channels are strongly correlated: their mean, not their sum.
            out[y, x] = max(-MOST, min(MOST, 0.5 * (away + log(wide)) / 3))
    return out


@compiled
def _with_odds(share: Floats, informative: Floats, odds: Floats) -> Floats:
    """Shares updated by the smoothed log odds where they are informative."""
    out = share.copy()
    for y in range(share.shape[0]):
        for x in range(share.shape[1]):
            if informative[y, x]:
                known = max(0.02, min(0.98, share[y, x]))
                out[y, x] = 1 / (1 + exp(-odds[y, x] - STEEP * log(known / (1 - known))))
    return out

"""Outline refinement: pixels near an outline are reassigned to the side whose tones they resemble.

Cells are several pixels wide, and some lie across the border of an object: a dark sky, a gap between
legs. Three descriptions of either side say to which a pixel belongs: mean and variance of tones in a
window (after Lankton and Tannenbaum, Localizing region-based active contours, 2008, with local Gaussians
as in Wang, He, Mishra and Li, 2009), histograms of the colours of the object and of what surrounds it
(pixel-wise posteriors, Bibby and Reid 2008), and the motion of either side (`outline_motion.py`), which
tells them apart where both have the same colours. Neighbours that look
alike pull each other to one side, so that the border comes to lie where tones change (the energy of
Rother, Kolmogorov and Blake, GrabCut, 2004, by mean field instead of a cut). Since the first two
descriptions hang on the outline, all is done twice. Where both sides look and move alike hardly anything
changes.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.percepts.motion.features.work_image import Floats
from visup.percepts.motion.outlines._outline_refinement_jit import (
    Places,
    gaps_to_neighbours,
    histogram_odds,
    mean_field,
    places_of,
    share_odds,
    window_log_odds,
)
from visup.percepts.motion.outlines.outline_motion import CropMotion

ROUNDS = 2  # times that the sides are described and the outline is moved
WINDOW_SIDE = 21  # pixels: side of the window whose tones are compared
HALF_WINDOW = (WINDOW_SIDE // 2 + 1, WINDOW_SIDE // 2 + 1)  # the same in the image at half the size
BAND_WIDTH = 5  # pixels from the outline within which pixels may change sides
RING_WIDTH = 12  # pixels beyond the outline that count as surroundings
LEAST = 0.08  # share of the window that each side must fill
NOISE = 6.0  # least standard deviation of tones
MOST = 3.0  # log odds that either description may give to a pixel at most
SHARED_PIXELS = 0.1  # share of the window that describes both sides
SMOOTHING_PIXELS = 20.0  # pixels that speak for neither side, added to each bin of the histograms
LOCAL_WEIGHT = 1.5  # weight of the log odds by tones in the window
COLOUR_WEIGHT = 1.1  # weight of the log odds by colours
MOTION_WEIGHT = 1.0  # weight of the log odds by motion
PRIOR_MARGIN = 0.02  # a prior share is at least as far from 0 and 1
PRIOR_WEIGHT = 0.7  # weight of a pixel's prior share, per unit of log odds
NEIGHBOUR_WEIGHT = 32.0  # log odds that a neighbour just alike and sure of its side adds
SWEEPS = 3  # passes of mean field in a round
Means = tuple[Floats, Floats]
"""(h / 2, w / 2, 3) means of tones in windows, and of their squares."""

CONTEXT = WINDOW_SIDE // 2 + BAND_WIDTH
"""Margin around the object that a crop for refinement needs, pixels."""


def refine_outline(
    share: Floats, tone: NDArray[np.uint8], motion: CropMotion | None = None
) -> Floats:
    """Shares after pixels near the outline were assigned to the side they resemble.

    Args:
        share: (h, w) float32 probability of an object.
        tone: (h, w, 3) uint8.
        motion: Where these pixels come from; None for a single image.

    Returns:
        (h, w) float32; above one half inside.
    """
    half = _halved(tone)
    every = window_means(half)
    flows = None if motion is None else motion.side_flows((share > 0.5).view(np.uint8))
    for _ in range(ROUNDS):
        inside = (share > 0.5).view(np.uint8)
        near = places_of(_grown(inside, BAND_WIDTH) != _shrunk(inside, BAND_WIDTH))
        if not len(near):
            return share
        local = local_log_odds(inside, near, tone, half, every)
        colours = histogram_log_odds(inside, near, tone)
        prior = np.log(share_odds(share, near, PRIOR_MARGIN))
        sum_of_odds = LOCAL_WEIGHT * local + COLOUR_WEIGHT * colours + PRIOR_WEIGHT * prior
        odds = np.asarray(sum_of_odds, dtype=np.float32)
        if motion is not None and flows is not None:
            odds += MOTION_WEIGHT * motion.log_odds(near, flows)
        alike = likeness_of_neighbours(near, tone)
        share = mean_field(share, near, odds, alike, NEIGHBOUR_WEIGHT, SWEEPS)
    return share


def local_log_odds(
    inside: NDArray[np.uint8],
    near: Places,
    tone: NDArray[np.uint8],
    half: NDArray[np.uint8],
    every: Means,
) -> Floats:
    """Log odds of pixels to be inside, by the tones on either side in a window around them.

    Args:
        inside: (h, w) 1 inside, 0 elsewhere.
        near: (N, 2) rows and columns of the pixels.
        tone: (h, w, 3) uint8.
        half: The same at half the size.
        every: From `window_means` of all tones.

    Returns:
        (N,) float32; 0 where a side fills too little of the window.
    """
    some = _halved(inside)
    full = np.asarray(cv2.boxFilter(some, cv2.CV_32F, HALF_WINDOW), dtype=np.float32)
    mine = np.asarray(cv2.bitwise_and(half, half, mask=some), dtype=np.uint8)
    return window_log_odds(
        near, full, tone, window_means(mine), every, (LEAST, NOISE, MOST, SHARED_PIXELS)
    )


def histogram_log_odds(inside: NDArray[np.uint8], near: Places, tone: NDArray[np.uint8]) -> Floats:
    """Log odds of pixels to be inside, by histograms of the object and of what surrounds it.

    Args:
        inside: (h, w) 1 inside, 0 elsewhere.
        near: (N, 2) rows and columns of the pixels.
        tone: (h, w, 3) uint8.

    Returns:
        (N,) float32.
    """
    odds = histogram_odds(near, inside, _grown(inside, RING_WIDTH), tone, SMOOTHING_PIXELS)
    # NumPy takes logarithms of many numbers at once, compiled loops one by one.
    return np.asarray(np.clip(np.log(odds), -MOST, MOST))


def likeness_of_neighbours(near: Places, tone: NDArray[np.uint8]) -> Floats:
    """How alike each pixel and its four neighbours are, (N, 4) float32: 0 to 1, 0 beyond the image.

    The scale is the mean difference of the pixels given, so that it adapts to contrast and noise.
    """
    gaps, sharp = gaps_to_neighbours(near, tone)
    return np.asarray(np.exp(gaps * np.float32(-sharp)))


def window_means(tones: NDArray[np.uint8]) -> Means:
    """Means of tones at half the size, and of their squares, in the window around each pixel."""
    return (
        np.asarray(cv2.boxFilter(tones, cv2.CV_32F, HALF_WINDOW), dtype=np.float32),
        np.asarray(cv2.sqrBoxFilter(tones, cv2.CV_32F, HALF_WINDOW), dtype=np.float32),
    )


def _halved(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Every other pixel, which is enough for means over a window."""
    return np.ascontiguousarray(image[::2, ::2])


def _grown(mask: NDArray[np.uint8], by: int) -> NDArray[np.uint8]:
    return np.asarray(cv2.dilate(mask, _square(by)), dtype=np.uint8)


def _shrunk(mask: NDArray[np.uint8], by: int) -> NDArray[np.uint8]:
    return np.asarray(cv2.erode(mask, _square(by)), dtype=np.uint8)


def _square(by: int) -> NDArray[np.uint8]:
    return np.ones((2 * by + 1, 2 * by + 1), np.uint8)

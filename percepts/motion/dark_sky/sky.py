"""Segmentation of a dark sky, and of the connected components that are brighter than it.

Black space has one tone, and no shadow falls on it. Whatever is brighter is therefore a body, a star, or the
Earth, whether it moves or not, and its outline is where the tone changes. Parts as dark as the sky are
missed.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.percepts.motion.outlines.region_outline import chosen, label_areas, renumbered

Mask = NDArray[np.bool_]

DARKEST = 30  # levels below which a pixel may be sky
MIN_SKY = 0.15  # share of the image that must be dark
ONE_TONE = 0.9  # share of the dark pixels that must have the sky's tone: a dark room has many tones
SPREAD = 6.0  # tolerance of the sky's tone, levels
MAX_NOISE = 4.0  # greatest standard deviation of the sky's noise, levels
EVERY = 4  # stride of the pixels from which the sky's tone is estimated
BRIGHTER = 9.0  # levels above the sky from which a pixel is a body: halos of compression are below
SIGMAS = 5.0  # the same, in standard deviations of the sky's noise
SMOOTH = 3  # side of the window over which tones are averaged, pixels
HALO = 0.7  # least level of a pixel at an outline, as a share of its brightest neighbour's
ROUNDS = 2  # greatest width of the halos that are trimmed, pixels
JOINED = 0.012  # greatest gap within a body, as a share of the image diagonal
SPECK = 0.2  # greatest area of a star, as a share of the least area of a body
BIGGEST = 0.5  # greatest area of a body, as a share of the image: larger ones are background


@dataclass(frozen=True, slots=True, eq=False)
class Components:
    """Bright connected components in front of a dark sky; gaps of up to `JOINED` do not separate them.

    Attributes:
        bright: (H, W) bool, pixels brighter than the sky.
        labels: (H, W) int32, component of each pixel, from 1; 0 for the sky and for components that are too
            small or too large.
        areas: (N + 1,) int64, number of bright pixels of each component; areas[0] is 0.
        cut: (N + 1,) bool, whether each touches the border of the image; cut[0] is False.
    """

    bright: Mask
    labels: NDArray[Any]
    areas: NDArray[np.int64]
    cut: Mask


def bright_components(tone: NDArray[np.uint8], least: float) -> Components | None:
    """The components of an image that are brighter than a dark sky.

    Args:
        tone: (H, W) uint8, from `brightness`.
        least: Least area of a component, pixels.

    Returns:
        The components, or None if the image shows no dark sky.
    """
    sky = sky_tone(tone)
    if sky is None:
        return None
    level, noise = sky
    smooth = cv2.blur(tone, (SMOOTH, SMOOTH))
    bright = np.asarray(smooth > level + max(BRIGHTER, SIGMAS * noise / SMOOTH))
    bright_enough = without_halos(tone, level)
    for _ in range(ROUNDS):
        bright = _trimmed(bright, bright_enough)
    return _labelled(bright, least)


def brightness(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """The maximum over the channels of each pixel, (H, W) uint8, since in grey a blue panel would be dark.

    Args:
        image: (H, W), (H, W, 1) or (H, W, 3) uint8.
    """
    if image.ndim == 2 or image.shape[2] == 1:
        return image.reshape(image.shape[:2])
    blue, green, red = cv2.split(image)
    return np.asarray(cv2.max(cv2.max(blue, green), red), np.uint8)


def sky_tone(tone: NDArray[np.uint8]) -> tuple[float, float] | None:
    """The level of a dark sky and the standard deviation of its noise; None when there is no dark sky.

    Args:
        tone: (H, W) uint8, from `brightness`.
    """
    some = tone[::EVERY, ::EVERY]
    dark = some[some < DARKEST].astype(np.float32)
    if dark.size < MIN_SKY * some.size:
        return None
    level = float(np.median(dark))
    off = np.abs(dark - level)
    noise = 1.4826 * float(np.median(off))
    same = float(np.mean(off <= max(SPREAD, 3 * noise)))
    return (level, noise) if noise <= MAX_NOISE and same >= ONE_TONE else None


def without_halos(tone: NDArray[np.uint8], level: float) -> Mask:
    """Pixels that are no halo: at least `HALO` times as far above the sky as their brightest neighbour.

    Args:
        tone: (H, W) uint8, from `brightness`.
        level: Tone of the sky, 0 to 255.

    Returns:
        (H, W) bool; meaningful only for pixels brighter than the sky.
    """
    lit = np.arange(256, dtype=np.float32)
    halos = np.searchsorted(np.arange(256) - level, HALO * (lit - level), side="right")
    brightest_halo = (np.maximum(halos, 1) - 1).astype(np.uint8)
    return np.asarray(tone > cv2.LUT(cv2.dilate(tone, square(3)), brightest_halo))


def joining_gap(shape: tuple[int, ...]) -> int:
    """Greatest width of gaps within a body, pixels; odd, as the side of a structuring element.

    Args:
        shape: (height, width) of the image.
    """
    return 2 * (round(JOINED * float(np.hypot(shape[0], shape[1]))) // 2) + 1


def square(side: int) -> NDArray[np.uint8]:
    """A square structuring element, (side, side) uint8."""
    return np.ones((side, side), np.uint8)


def _trimmed(bright: Mask, bright_enough: Mask) -> Mask:
    """Bright pixels without halos: pixels at the outline that are lit only by blur of a brighter neighbour.

    Lenses and compression blur edges, which would put the outline outside of the body.
    """
    inner = cv2.erode(bright.view(np.uint8), square(3)).view(bool)
    return np.asarray(bright & (inner | bright_enough))


def _labelled(bright: Mask, least: float) -> Components:
    bright = _without_specks(bright, SPECK * least)
    kernel = square(joining_gap(bright.shape))
    closed = cv2.morphologyEx(bright.view(np.uint8), cv2.MORPH_CLOSE, kernel)
    count, labels = cv2.connectedComponents(closed, connectivity=4, ltype=cv2.CV_32S)
    areas = label_areas(np.where(bright, labels, 0), count)
    areas[0] = 0
    good = (areas >= least) & (areas <= BIGGEST * bright.size)
    number = np.where(good, np.cumsum(good), 0).astype(np.int32)
    labels = renumbered(labels, number)
    kept = np.concatenate([[0], areas[good]]).astype(np.int64)
    cut = np.zeros(len(kept), bool)
    cut[np.concatenate([labels[0], labels[-1], labels[:, 0], labels[:, -1]])] = True
    cut[0] = False
    return Components(bright, labels, kept, cut)


def _without_specks(bright: Mask, most: float) -> Mask:
    """The mask without connected components of up to `most` pixels."""
    count, labels = cv2.connectedComponents(bright.view(np.uint8), connectivity=8, ltype=cv2.CV_32S)
    keep = label_areas(labels, count) > most
    keep[0] = False
    return chosen(labels, keep) if count > 1 else bright

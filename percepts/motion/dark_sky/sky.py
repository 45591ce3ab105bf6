"""A dark sky, and the components of the picture that are brighter than it.

Black space has one tone, and no shadow can fall on it. So what is brighter is a body, a star, or the Earth,
whether it moves or not, and its outline is where the tone changes. What is as dark as the sky is lost.
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
LEAST_SKY = 0.15  # share of the picture that must be sky
ONE_TONE = 0.9  # share of the dark pixels that must have the sky's tone: a dark room has many
SPREAD = 6.0  # levels from the sky's by which these may differ
MOST_NOISE = 4.0  # standard deviation of its tones, levels
EVERY = 4  # pixels: every so many are looked at for the sky's tone
BRIGHTER = (
    9.0  # levels above the sky from which a pixel is a body: compression leaves halos of less
)
SIGMAS = 5.0  # the same, in standard deviations of the sky
SMOOTH = 3  # pixels: side of the window over which tones are averaged
HALO = 0.7  # share of the brightest neighbour's level that a pixel of an outline must have
ROUNDS = 2  # pixels by which such halos are trimmed at most
JOINED = 0.012  # gaps of up to this share of the image diagonal do not part a body
SPECK = 0.2  # share of the least area up to which a connected bright spot is a star
BIGGEST = 0.5  # share of the picture: a larger component is a ground


@dataclass(frozen=True, slots=True, eq=False)
class Components:
    """Bright components before a dark sky.

    Attributes:
        bright: (H, W) bool: pixels brighter than the sky.
        labels: (H, W) int: component of each pixel; 0 for the sky and for what is too small or large.
        areas: (N + 1,) bright pixels of each; 0 first.
        cut: (N + 1,) bool: whether it touches the border of the image.
    """

    bright: Mask
    labels: NDArray[Any]
    areas: NDArray[np.int64]
    cut: Mask


def bright_components(tone: NDArray[np.uint8], least: float) -> Components | None:
    """The components of a picture that are brighter than a dark sky.

    Args:
        tone: (H, W) uint8, from `brightness`.
        least: Least area, pixels.

    Returns:
        The components, or None when the picture shows no dark sky.
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
    """The brightest channel of each pixel, (H, W) uint8: a blue panel is dark in grey."""
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
    if dark.size < LEAST_SKY * some.size:
        return None
    level = float(np.median(dark))
    off = np.abs(dark - level)
    noise = 1.4826 * float(np.median(off))
    same = float(np.mean(off <= max(SPREAD, 3 * noise)))
    return (level, noise) if noise <= MOST_NOISE and same >= ONE_TONE else None


def without_halos(tone: NDArray[np.uint8], level: float) -> Mask:
    """Where a pixel has enough of its brightest neighbour's level above the sky not to be a halo.

    Args:
        tone: (H, W) uint8, from `brightness`.
        level: Of the sky.

    Returns:
        (H, W) bool; only what is brighter than the sky is judged.
    """
    lit = np.arange(256, dtype=np.float32)
    halos = np.searchsorted(np.arange(256) - level, HALO * (lit - level), side="right")
    brightest_halo = (np.maximum(halos, 1) - 1).astype(np.uint8)
    return np.asarray(tone > cv2.LUT(cv2.dilate(tone, square(3)), brightest_halo))


def joining_gap(shape: tuple[int, ...]) -> int:
    """Width of the gaps that do not part a body, pixels; odd.

    Args:
        shape: (height, width) of the image.
    """
    return 2 * (round(JOINED * float(np.hypot(shape[0], shape[1]))) // 2) + 1


def square(side: int) -> NDArray[np.uint8]:
    """A square structuring element."""
    return np.ones((side, side), np.uint8)


def _trimmed(bright: Mask, bright_enough: Mask) -> Mask:
    """Bright pixels without those beside the sky that only catch the light of a brighter neighbour.

    Lenses and compression blur edges; of what is left the outline lies where the body ends.
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
    """Without connected spots of up to `most` pixels."""
    count, labels = cv2.connectedComponents(bright.view(np.uint8), connectivity=8, ltype=cv2.CV_32S)
    keep = label_areas(labels, count) > most
    keep[0] = False
    return chosen(labels, keep) if count > 1 else bright

"""A picture of what rests, pixel by pixel, for a camera that rests as well.

Each pixel keeps the tone that it shows at rest with its variance, and a candidate: the tone that it
shows instead of late. A candidate that has been seen longer than what is taken for the rest takes
its place, so that what stood there as the video began, and leaves, is not taken for an object for
ever. (After Stauffer and Grimson, Adaptive background mixture models, 1999, with two modes; shadows
after Horprasert, Harwood, Davis, A statistical approach for robust background subtraction, 1999.)
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.percepts.motion.image import Floats

Mask = NDArray[np.bool_]
NOISE = 4.0  # least standard deviation that is assumed, grey levels
FAR = 3.0  # standard deviations at which a pixel surely shows something else
NEAR = 2.2  # the same for one beside a sure one
SETTLE_S = 8.0  # time constant of what is learnt, seconds
RESTLESS_S = 8.0  # the same of the variance
SHADE = (0.6, 0.97)  # brightness in a shadow, as a share of that at rest
HUE = 0.055  # how far colour may differ in a shadow, as a share of brightness
RARE = 10.0  # squared distance beyond which a pixel tells no more of how restless it is
EVEN = 0.03  # change of exposure that is none
LIT = 1.12  # brightness in reflected light


@dataclass(frozen=True, slots=True, eq=False)
class Picture:
    """What rests.

    Attributes:
        mean: (h, w, 3) float32, tone at rest, grey levels.
        variance: (h, w) float32, of one channel.
        seen_s: (h, w) float32, for how long that tone was seen, seconds; 0 where the rest is unknown.
        other: (h, w, 3) float32, the tone that is seen instead.
        other_s: (h, w) float32, for how long.
    """

    mean: Floats
    variance: Floats
    seen_s: Floats
    other: Floats
    other_s: Floats


def first_picture(image: Floats) -> Picture:
    """What rests, after one (h, w, 3) image."""
    bare = np.zeros(image.shape[:2], np.float32)
    return Picture(image, bare + NOISE**2, bare + 0.01, image, bare)


def forgotten(picture: Picture, where: Mask) -> Picture:
    """The picture without what it shows in some places: an object may have stood there."""
    return replace(picture, seen_s=np.where(where, 0, picture.seen_s).astype(np.float32))


def filled(picture: Picture, image: Floats, bare: Mask) -> Picture:
    """The picture with what is seen of an image where it was unknown and nothing hides the rest."""
    new = bare & (picture.seen_s <= 0)
    if not new.any():
        return picture
    fresh = first_picture(image)
    return Picture(
        np.where(new[..., None], fresh.mean, picture.mean),
        np.where(new, fresh.variance, picture.variance),
        np.where(new, fresh.seen_s, picture.seen_s),
        np.where(new[..., None], fresh.other, picture.other),
        np.where(new, fresh.other_s, picture.other_s),
    )


def offset(picture: Picture, image: Floats) -> Floats:
    """Squared distance of each pixel to the picture, (h, w) float32; 1 is one standard deviation."""
    gap = image - picture.mean
    return np.asarray(np.einsum("ijk,ijk->ij", gap, gap) / (3 * picture.variance), np.float32)


def shaded(picture: Picture, image: Floats) -> Mask:
    """Where an image differs as a shadow or a reflection does: in brightness, not in hue."""
    m = picture.mean
    power = np.einsum("ijk,ijk->ij", m, m) + 1.0
    bright = np.einsum("ijk,ijk->ij", image, m) / power
    gap = image - bright[..., None] * m
    hue = np.einsum("ijk,ijk->ij", gap, gap)
    same = hue < (HUE * HUE) * power + 3 * NOISE**2 / 4
    return np.asarray(same & (bright > SHADE[0]) & (bright < LIT) & (power > 60.0**2))


def changed(picture: Picture, image: Floats) -> Mask:
    """Which pixels show something else than what rests, (h, w) bool; where that is unknown, none."""
    off = cv2.GaussianBlur(np.minimum(offset(picture, image), 100.0), (3, 3), 0.8)
    off = np.where(shaded(picture, image) | (picture.seen_s <= 0), 0, off)
    near = cv2.medianBlur((off > NEAR**2).astype(np.uint8), 5)
    _, labels = cv2.connectedComponents(near, connectivity=8)
    sure = np.zeros(labels.max() + 1, bool)
    sure[np.unique(labels[(off > (FAR * 1.5) ** 2) & (near > 0)])] = True
    sure[0] = False
    return np.asarray(sure[labels], dtype=bool)


def learnt(
    picture: Picture, image: Floats, moving: Mask, seconds: float, gone: Mask | None = None
) -> Picture:
    """The picture after one more image.

    Args:
        picture: As known.
        image: (h, w, 3) float32.
        moving: (h, w) bool, where objects are told: there the rest is not easily given up.
        seconds: Since the last image.
        gone: (h, w) bool, where something that was taken for the rest has left: it is forgotten.

    Returns:
        The new picture.
    """
    off = offset(picture, image)
    known = picture.seen_s > 0
    fits = (off < FAR**2) & ~moving & known
    weight = np.maximum(seconds / (picture.seen_s + seconds), 1 - np.exp(-seconds / SETTLE_S))
    weight = np.where(fits, weight, 0).astype(np.float32)
    mean = picture.mean + weight[..., None] * (image - picture.mean)
    spread = np.float32(1 - np.exp(-seconds / RESTLESS_S))
    # Leaves and water go far and come back; one object that passes weighs little.
    wide = (
        picture.variance
        + np.where(moving, 0, spread) * (np.minimum(off, RARE) - 1) * picture.variance
    )
    variance = np.clip(wide, NOISE**2, (8 * NOISE) ** 2)
    seen = np.minimum(picture.seen_s + fits * np.float32(seconds), 60.0)
    gap = image - picture.other
    alike = np.einsum("ijk,ijk->ij", gap, gap) < 3 * (FAR * NOISE) ** 2
    away = ~fits & known
    other_s = np.where(away, np.where(alike, picture.other_s + seconds, seconds), picture.other_s)
    step = np.where(away, np.where(alike, 0.3, 1.0), 0)[..., None]
    other = picture.other + step * gap
    enough = np.where(moving, 3 * picture.seen_s, np.minimum(picture.seen_s, 20.0)) + 0.2
    swap = other_s > enough
    if gone is not None:
        other = np.where(gone[..., None], image, other)
        swap |= gone & known
    mean = np.where(swap[..., None], other, mean)
    variance = np.where(swap, NOISE**2 * 2, variance)
    seen, other_s = np.where(swap, other_s, seen), np.where(swap, 0, other_s)
    return Picture(*(np.asarray(a, np.float32) for a in (mean, variance, seen, other, other_s)))


def edges(image: Floats) -> Floats:
    """(h, w) float32 strength of the edges of a (h, w, 3) image."""
    grey = image.mean(axis=2)
    return np.asarray(
        np.hypot(cv2.Sobel(grey, cv2.CV_32F, 1, 0), cv2.Sobel(grey, cv2.CV_32F, 0, 1)), np.float32
    )


def exposed(picture: Picture, image: Floats) -> Picture:
    """The picture as it would look at the exposure of an image, after the median change of tone."""
    step = 4
    rest, now = picture.mean[::step, ::step], image[::step, ::step]
    ratio = np.median((now + 1.0) / (rest + 1.0), axis=(0, 1))
    if np.abs(ratio - 1).max() < EVEN:
        return picture
    gain = np.clip(ratio, 0.3, 3.0).astype(np.float32)
    return replace(picture, mean=picture.mean * gain, other=picture.other * gain)

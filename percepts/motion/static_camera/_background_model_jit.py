"""Compiled loops of `background_model`: per-pixel distances, shadows, foreground and update."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from visup.compiled import compiled
from visup.percepts.motion.features.work_image import Floats

Mask = NDArray[np.bool_]


class BackgroundPlanes(NamedTuple):
    """The fields of `BackgroundModel`, in order."""

    mean: Floats
    variance: Floats
    seen_s: Floats
    other: Floats
    other_s: Floats


class ShadowLimits(NamedTuple):
    """Limits within which a pixel is a shadow or reflection on the background.

    Attributes:
        darkest: Least brightness, as a share of the background's.
        brightest: Greatest brightness, of reflected light.
        hue: Greatest difference of colour, as a share of brightness.
        noise: Further squared difference that is tolerated, squared grey levels.
        least: Squared background brightness below which a pixel is too dark to decide.
    """

    darkest: float
    brightest: float
    hue: float
    noise: float
    least: float


class LearningRates(NamedTuple):
    """Learning rates and limits of the update.

    Attributes:
        seconds: Since the last image.
        settle: Least weight of an image.
        restless: Weight of an image for the variance.
        fits: Squared distance, in variances, below which a pixel shows the background.
        rare: Squared distance at which its effect on the variance is clipped.
        least: Least variance.
        most: Greatest variance.
        alike: Squared distance, over three channels, below which two tones are the same.
    """

    seconds: float
    settle: float
    restless: float
    fits: float
    rare: float
    least: float
    most: float
    alike: float


@compiled
def normalised_distances(image: Floats, mean: Floats, variance: Floats, most: float) -> Floats:
    """Squared distance of each pixel to the background, in variances, at most `most`, (h, w)."""
    height, width = variance.shape
    out = np.empty((height, width), np.float32)
    for y in range(height):
        for x in range(width):
            total = np.float32(0)
            for i in range(3):
                gap = image[y, x, i] - mean[y, x, i]
                total += gap * gap
            out[y, x] = min(total / (np.float32(3) * variance[y, x]), np.float32(most))
    return out


@compiled
def _is_shadow(image: Floats, mean: Floats, y: int, x: int, shade: ShadowLimits) -> bool:
    """Whether a pixel differs from the background in brightness but not in hue."""
    power, common, own = 1.0, 0.0, 0.0
    for i in range(3):
        here, now = float(mean[y, x, i]), float(image[y, x, i])
        power, common, own = power + here * here, common + now * here, own + now * now
    bright = common / power
    # Squared residual of the tone after the background, scaled to its brightness, is subtracted.
    hue = own - 2 * bright * common + bright * bright * (power - 1)
    same = hue < shade.hue * shade.hue * power + shade.noise
    return same and shade.darkest < bright < shade.brightest and power > shade.least


@compiled
def shadow_pixels(image: Floats, mean: Floats, shade: ShadowLimits) -> Mask:
    """Where an image differs from the background in brightness but not in hue, (h, w)."""
    height, width = mean.shape[:2]
    out = np.empty((height, width), np.bool_)
    for y in range(height):
        for x in range(width):
            out[y, x] = _is_shadow(image, mean, y, x, shade)
    return out


@compiled
def foreground_pixels(
    off: Floats, image: Floats, mean: Floats, seen_s: Floats, shade: ShadowLimits, least: float
) -> Mask:
    """Pixels further than `least` from a known background, without shadows and reflections, (h, w)."""
    height, width = off.shape
    out = np.zeros((height, width), np.bool_)
    for y in range(height):
        for x in range(width):
            if off[y, x] > least and seen_s[y, x] > 0:
                out[y, x] = not _is_shadow(image, mean, y, x, shade)
    return out


@compiled
def pixels_near_sure_ones(
    labels: NDArray[np.int32], off: Floats, out_of: Mask, count: int, least: float
) -> Mask:
    """Hysteresis thresholding: the pixels of components that somewhere exceed `least`.

    Args:
        labels: (h, w) number of the component of each pixel, 0 for none.
        off: (h, w) float32, squared distance of each pixel.
        out_of: (h, w), foreground pixels.
        count: Number of components, including 0.
        least: High threshold that one pixel of a component must exceed.
    """
    height, width = labels.shape
    sure = np.zeros(count, np.bool_)
    for y in range(height):
        for x in range(width):
            if off[y, x] > least and out_of[y, x]:
                sure[labels[y, x]] = True
    sure[0] = False
    out = np.empty((height, width), np.bool_)
    for y in range(height):
        for x in range(width):
            out[y, x] = sure[labels[y, x]]
    return out


@compiled
def update_planes(
    known: BackgroundPlanes, image: Floats, moving: Mask, gone: Mask, pace: LearningRates
) -> BackgroundPlanes:
    """The background model after one more (h, w, 3) image.

    Args:
        known: The previous model.
        image: The image.
        moving: (h, w) where objects are reported: there the background is replaced less easily.
        gone: (h, w) where an object that was part of the background has left.
        pace: Learning rates.
    """
    height, width = moving.shape
    mean, other = np.empty((height, width, 3), np.float32), np.empty((height, width, 3), np.float32)
    variance, seen_s = np.empty((height, width), np.float32), np.empty((height, width), np.float32)
    other_s = np.empty((height, width), np.float32)
    zero, one, three = np.float32(0), np.float32(1), np.float32(3)
    seconds, settle, restless = (
        np.float32(pace.seconds),
        np.float32(pace.settle),
        np.float32(pace.restless),
    )
    fits_below, rare, alike_below = (
        np.float32(pace.fits),
        np.float32(pace.rare),
        np.float32(pace.alike),
    )
    least, most = np.float32(pace.least), np.float32(pace.most)
    # Row by row, in single precision throughout: half the time of indices and constants that are wider.
    for y in range(height):
        tones, old_mean, old_other = image[y], known.mean[y], known.other[y]
        old_variance, old_seen, old_other_s = known.variance[y], known.seen_s[y], known.other_s[y]
        new_mean, new_other, moving_row, gone_row = mean[y], other[y], moving[y], gone[y]
        new_variance, new_seen, new_other_s = variance[y], seen_s[y], other_s[y]
        for x in range(width):
            spread, seen, instead = old_variance[x], old_seen[x], old_other_s[x]
            off = _squared_distance(tones, old_mean, x) / (three * spread)
            moves, is_known = moving_row[x], seen > zero
            fits = (off < fits_below) & (not moves) & is_known
            weight = max(seconds / (seen + seconds), settle) if fits else zero
            step = zero
            if is_known and not fits:
                alike = _squared_distance(tones, old_other, x) < alike_below
                step = np.float32(0.3) if alike else one
                instead = instead + seconds if alike else seconds
            for i in range(3):
                now, old, before = tones[x, i], old_mean[x, i], old_other[x, i]
                new_mean[x, i] = old + weight * (now - old)
                new_other[x, i] = before + step * (now - before)
            # Leaves and water vary strongly and return; a single passing object has little effect.
            if not moves:
                spread += restless * (min(off, rare) - one) * spread
            enough = (three * seen if moves else min(seen, np.float32(20))) + np.float32(0.2)
            if fits:
                seen = min(seen + seconds, np.float32(60))
            if gone_row[x]:
                new_other[x] = tones[x]
            new_variance[x] = max(least, min(most, spread))
            new_seen[x], new_other_s[x] = seen, instead
            if instead > enough or (gone_row[x] and is_known):
                new_mean[x] = new_other[x]
                new_variance[x], new_seen[x], new_other_s[x] = 2 * least, instead, zero
    return BackgroundPlanes(mean, variance, seen_s, other, other_s)


@compiled
def _squared_distance(tones: Floats, others: Floats, x: int) -> np.float32:
    """Squared distance of a pixel of two rows, (w, 3)."""
    a = tones[x, 0] - others[x, 0]
    b = tones[x, 1] - others[x, 1]
    c = tones[x, 2] - others[x, 2]
    return np.float32(a * a + b * b + c * c)

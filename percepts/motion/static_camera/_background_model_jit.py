"""Compiled loops of `background_model`: per-pixel distances, shadows, foreground and update."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from visup.compiled import compiled
from visup.percepts.motion.features.work_image import Floats
from visup.percepts.motion.outlines.region_outline import chosen

Mask = NDArray[np.bool_]
FIRST_S = 0.01  # how long a background counts as seen after a single image, seconds


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
        settle: Least learning rate of the mean.
        restless: Learning rate of the variance.
        fits: Squared distance, in variances, below which a pixel shows the background.
        rare: Squared distance, in variances, at which a pixel's effect on the variance is clipped.
        least: Least variance, squared grey levels.
        most: Greatest variance, squared grey levels.
        alike: Squared distance, summed over three channels, below which two tones are the same.
        slowly: Factor on the time for which a candidate is seen on an object of `Covered.things`.
    """

    seconds: float
    settle: float
    restless: float
    fits: float
    rare: float
    least: float
    most: float
    alike: float
    slowly: float


class Covered(NamedTuple):
    """Where objects are, each (h, w) bool.

    Attributes:
        moving: Objects are reported: the background is replaced less easily.
        gone: An object that was part of the background has left: the background is replaced at once.
        things: An object hides a background that was known before: it is hardly ever replaced.
    """

    moving: Mask
    gone: Mask
    things: Mask


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
    # Squared residual of the pixel after subtracting the background at the pixel's brightness.
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
    return chosen(labels, sure)


@compiled
def update_planes(
    planes: BackgroundPlanes, image: Floats, covered: Covered, pace: LearningRates
) -> None:
    """Update the background model with one more (h, w, 3) image, in place.

    Args:
        planes: The model.
        image: The image.
        covered: Where objects are.
        pace: Learning rates.
    """
    mean, other = planes.mean, planes.other
    moving, gone, things = covered
    variance, seen_s, other_s = planes.variance, planes.seen_s, planes.other_s
    height, width = moving.shape
    for y in range(height):
        for x in range(width):
            spread, seen, instead = variance[y, x], seen_s[y, x], other_s[y, x]
            off = _squared_distance(image, mean, y, x) / (np.float32(3) * spread)
            moves, is_known = moving[y, x], seen > 0
            fits = off < pace.fits and not moves and is_known
            away = is_known and not fits
            weight = np.float32(max(pace.seconds / (seen + pace.seconds), pace.settle))
            weight = weight if fits else np.float32(0)
            step = np.float32(0)
            if away:
                alike = _squared_distance(image, other, y, x) < pace.alike
                step = np.float32(0.3 if alike else 1.0)
                lasted = pace.seconds * pace.slowly if things[y, x] else pace.seconds
                instead = instead + lasted if alike else lasted
            _approach(mean, image, y, x, weight)
            _approach(other, image, y, x, step)
            # Leaves and water vary often, which raises the variance; a single passing object hardly does,
            # since `rare` clips its effect.
            if not moves:
                spread += pace.restless * (min(off, pace.rare) - 1) * spread
            enough = (3 * seen if moves else min(seen, 20.0)) + 0.2
            if fits:
                seen = min(seen + pace.seconds, 60.0)
            if gone[y, x]:
                other[y, x] = image[y, x]
            variance[y, x] = max(pace.least, min(pace.most, spread))
            seen_s[y, x], other_s[y, x] = seen, instead
            if instead > enough or (gone[y, x] and is_known):
                mean[y, x] = other[y, x]
                variance[y, x], seen_s[y, x], other_s[y, x] = 2 * pace.least, instead, 0.0


@compiled
def _approach(tones: Floats, image: Floats, y: int, x: int, step: np.float32) -> None:
    """Blend one pixel of (h, w, 3) `tones` with the image, in place, with weight `step`, 0 to 1."""
    if step > 0:
        for i in range(3):
            tones[y, x, i] += step * (image[y, x, i] - tones[y, x, i])


@compiled
def reveal_planes(planes: BackgroundPlanes, image: Floats, bare: Mask, start: float) -> None:
    """Initialise the background, in place, from a (h, w, 3) image where it was unknown.

    Args:
        planes: The model.
        image: The image.
        bare: (h, w) where no object hides the background.
        start: Initial variance.
    """
    height, width = bare.shape
    for y in range(height):
        for x in range(width):
            if bare[y, x] and planes.seen_s[y, x] <= 0:
                planes.mean[y, x], planes.other[y, x] = image[y, x], image[y, x]
                planes.variance[y, x], planes.seen_s[y, x] = start, FIRST_S
                planes.other_s[y, x] = 0.0


@compiled
def has_exposure(image: Floats, mean: Floats, step: int, even: float) -> bool:
    """Whether the exposure of an image equals the background's: a test that is cheaper than the median.

    Args:
        image: (h, w, 3) the image.
        mean: (h, w, 3) tone of the background.
        step: Stride of the sampled rows and columns.
        even: Relative difference of brightness that is tolerated.

    Returns:
        Whether in each channel more than half of the sampled pixels are within `even` of the background, on
        either side, which implies that the median ratio is.
    """
    least, most = np.float32(1 - even), np.float32(1 + even)
    for i in range(3):
        dark, bright, number = 0, 0, 0
        for y in range(0, mean.shape[0], step):
            for x in range(0, mean.shape[1], step):
                ratio = (image[y, x, i] + np.float32(1)) / (mean[y, x, i] + np.float32(1))
                dark, bright, number = dark + (ratio <= least), bright + (ratio >= most), number + 1
        if 2 * (max(dark, bright) + 1) >= number:
            return False
    return True


@compiled
def _squared_distance(image: Floats, tones: Floats, y: int, x: int) -> float:
    """Squared distance of a pixel of (h, w, 3) images."""
    a = image[y, x, 0] - tones[y, x, 0]
    b = image[y, x, 1] - tones[y, x, 1]
    c = image[y, x, 2] - tones[y, x, 2]
    return float(a * a + b * b + c * c)

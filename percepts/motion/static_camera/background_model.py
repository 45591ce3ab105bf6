"""A per-pixel background model for a static camera.

Each pixel has a background tone with its variance, and a candidate: the tone that it has shown instead
recently. A candidate that has been seen longer than the background replaces it, so that the place of an
object that was there when the video began, and leaves, does not remain foreground for ever. (After Stauffer
and Grimson, Adaptive background mixture models, 1999, with two modes; shadows after Horprasert, Harwood,
Davis, A statistical approach for robust background subtraction, 1999.)
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.agent.model.fast_replace import replace
from visup.percepts.motion.features.work_image import Floats
from visup.percepts.motion.static_camera._background_model_jit import (
    FIRST_S,
    BackgroundPlanes,
    Covered,
    LearningRates,
    ShadowLimits,
    foreground_pixels,
    has_exposure,
    normalised_distances,
    pixels_near_sure_ones,
    reveal_planes,
    shadow_pixels,
    update_planes,
)

Mask = NDArray[np.bool_]
NOISE = 4.0  # least standard deviation that is assumed, grey levels
FAR = 3.0  # standard deviations beyond which a pixel is certainly foreground (high threshold)
NEAR = 2.2  # the same for pixels connected to such a one (low threshold)
SETTLE_S = 8.0  # time constant of the mean, seconds
RESTLESS_S = 8.0  # time constant of the variance, seconds
SHADE = 0.6  # least brightness in a shadow, as a share of the background's
HUE = 0.055  # greatest difference of colour in a shadow, as a share of brightness
RARE = 10.0  # squared distance, in variances, at which a pixel's effect on the variance is clipped
SLOWLY = 0.01  # factor on the time for which a resting object is seen: minutes to hours to replace
EVEN = 0.03  # relative change of exposure that is ignored
SAMPLED = 4  # stride, along x and y, of the pixels from which the exposure is estimated
LIT = 1.12  # greatest brightness in reflected light, as a share of the background's
CAST = ShadowLimits(SHADE, LIT, HUE, 3 * NOISE**2 / 4, 60.0**2)


@dataclass(frozen=True, slots=True, eq=False)
class BackgroundModel:
    """State of the background model. It owns its arrays, which are updated in place.

    Attributes:
        mean: (h, w, 3) float32, background tone, grey levels.
        variance: (h, w) float32, of one channel.
        seen_s: (h, w) float32, how long that tone was seen, seconds; 0 where the background is unknown.
        other: (h, w, 3) float32, tone of the candidate, grey levels.
        other_s: (h, w) float32, how long the candidate was seen, seconds.
    """

    mean: Floats
    variance: Floats
    seen_s: Floats
    other: Floats
    other_s: Floats


def initial_model(image: Floats) -> BackgroundModel:
    """The model after a single image, (h, w, 3) float32, BGR."""
    bare = np.zeros(image.shape[:2], np.float32)
    return BackgroundModel(
        image.copy(), bare + NOISE**2, bare + np.float32(FIRST_S), image.copy(), bare
    )


def with_unknown(background: BackgroundModel, where: Mask) -> BackgroundModel:
    """The model, unknown where `where` is set, (h, w) bool: an object may have hidden the background there.

    It shares the other arrays with the given one, which must not be used any more.
    """
    return replace(background, seen_s=np.where(where, 0, background.seen_s).astype(np.float32))


def reveal_background(background: BackgroundModel, image: Floats, bare: Mask) -> None:
    """Initialise the background, in place, from an image where it was unknown and no object hides it."""
    reveal_planes(_planes(background), image, bare, NOISE**2)


def shadow_mask(background: BackgroundModel, image: Floats) -> Mask:
    """(h, w) bool: where an image differs in brightness but not in hue, as in shadows and reflections."""
    return shadow_pixels(image, background.mean, CAST)


def foreground_mask(background: BackgroundModel, image: Floats) -> Mask:
    """Foreground pixels, (h, w) bool; False where the background is unknown."""
    far = normalised_distances(image, background.mean, background.variance, 100.0)
    off = np.asarray(cv2.GaussianBlur(far, (3, 3), 0.8), dtype=np.float32)
    out = foreground_pixels(off, image, background.mean, background.seen_s, CAST, NEAR**2)
    near = cv2.medianBlur(out.view(np.uint8), 5)
    count, labels = cv2.connectedComponents(near, connectivity=8)
    return pixels_near_sure_ones(np.asarray(labels, np.int32), off, out, count, (FAR * 1.5) ** 2)


def update_background(
    background: BackgroundModel,
    image: Floats,
    moving: Mask,
    seconds: float,
    gone: Mask | None = None,
    things: Mask | None = None,
) -> None:
    """Update the background, in place, with one more image.

    Args:
        background: The model.
        image: (h, w, 3) float32.
        moving: (h, w) bool, where objects are reported: a candidate must be seen for longer to replace the
            background.
        seconds: Since the last image.
        gone: (h, w) bool, ghosts: an object that was part of the background has left, so the image replaces
            the background at once.
        things: (h, w) bool, where an object hides a background that was known before it came: a candidate
            replaces it only after minutes or hours.
    """
    pace = LearningRates(
        seconds,
        1 - float(np.exp(-seconds / SETTLE_S)),
        1 - float(np.exp(-seconds / RESTLESS_S)),
        FAR**2,
        RARE,
        NOISE**2,
        (8 * NOISE) ** 2,
        3 * (FAR * NOISE) ** 2,
        SLOWLY,
    )
    nowhere = np.zeros(moving.shape, dtype=bool)
    covered = Covered(
        moving, nowhere if gone is None else gone, nowhere if things is None else things
    )
    update_planes(_planes(background), image, covered, pace)


def _planes(background: BackgroundModel) -> BackgroundPlanes:
    return BackgroundPlanes(*(getattr(background, f.name) for f in fields(background)))


def edge_strength(image: Floats, box: tuple[int, int, int, int]) -> Floats:
    """Strength of the edges of a (h, w, 3) image in a box (x0, y0, x1, y1), (y, x) float32."""
    x, y = max(box[0] - 1, 0), max(box[1] - 1, 0)
    grey = image[y : box[3] + 1, x : box[2] + 1].mean(axis=2)
    strength = np.hypot(cv2.Sobel(grey, cv2.CV_32F, 1, 0), cv2.Sobel(grey, cv2.CV_32F, 0, 1))
    inner = strength[box[1] - y : box[3] - y, box[0] - x : box[2] - x]
    return np.asarray(inner, np.float32)


def match_exposure(background: BackgroundModel, image: Floats) -> BackgroundModel:
    """The background at the exposure of an image, estimated as the median ratio of tones."""
    if has_exposure(image, background.mean, SAMPLED, EVEN):
        return background
    rest, now = background.mean[::SAMPLED, ::SAMPLED], image[::SAMPLED, ::SAMPLED]
    ratio = np.median((now + 1.0) / (rest + 1.0), axis=(0, 1))
    if np.abs(ratio - 1).max() < EVEN:
        return background
    gain = np.clip(ratio, 0.3, 3.0).astype(np.float32)
    return replace(background, mean=background.mean * gain, other=background.other * gain)

"""Bodies that touch or cover each other in the image share one bright component: who owns which pixel."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.percepts.motion.dark_sky.body import Corner, SkyBody, Slices, overlap
from visup.percepts.motion.dark_sky.sky import Mask

Tones = NDArray[np.uint8]

REACH = 4  # pixels around the expected place where a body is looked for
ALIKE = 30.0  # root mean square difference of levels up to which a body is found again
COVERS = 40.0  # difference of levels from which what the border cuts lies before a body
STRAY = (
    10.0  # squared difference of levels for which a body may lie a pixel from where it is expected
)
WINDOW = 9  # pixels: side of the window in which the differences of two bodies are compared

_STEPS = np.arange(-REACH, REACH + 1, dtype=np.float32) ** 2
_FAR = _STEPS[:, None] + _STEPS
"""Squared distances from the expected place, pixels."""


def placed(tone: Tones, body: SkyBody, now: float) -> tuple[Corner, bool]:
    """The corner of a body's box in a picture where it touches others, where its look fits best; does it fit?

    Where it fits nowhere it is expected where its velocity leads.

    Args:
        tone: (H, W) uint8.
        body: The body.
        now: Time of the picture, seconds.
    """
    x, y = body.expected(now)
    h, w = body.look.mask.shape
    left, top = x - REACH, y - REACH
    window = tone[max(top, 0) : y + h + REACH, max(left, 0) : x + w + REACH]
    if window.shape != (h + 2 * REACH, w + 2 * REACH):
        return (x, y), False
    weight = body.look.mask.view(np.uint8)
    cost = cv2.matchTemplate(window, body.look.tone, cv2.TM_SQDIFF, mask=weight) / body.area
    _, _, at, _ = cv2.minMaxLoc(cost + STRAY * _FAR)
    fits = cost[at[1], at[0]] <= ALIKE**2
    return ((left + at[0], top + at[1]) if fits else (x, y)), bool(fits)


def split(
    tone: Tones, union: Mask, bodies: Sequence[SkyBody], corners: Sequence[Corner]
) -> Mapping[int, Mask]:
    """Share bright pixels among bodies that touch in the image.

    Where the looks of several lie, the one that is more like the pixels there is in front. What the border
    cuts changes its look as more of it comes into view; it is in front where the others differ from theirs.
    Pixels of none go to the nearest body; with a single one they are something that is not known.

    Args:
        tone: (H, W) uint8.
        union: (H, W) bool: bright pixels of the components that they share.
        bodies: At least one.
        corners: Where the box of each lies.

    Returns:
        Key -> (H, W) bool.
    """
    x, y, w, h = cv2.boundingRect(union.view(np.uint8))
    part = np.s_[y : y + h, x : x + w]
    within = [(b, (at[0] - x, at[1] - y)) for b, at in zip(bodies, corners, strict=True)]
    owner = _owners(tone[part], union[part], within)
    return {b.key: _in_image(owner == k, part, union.shape) for k, b in enumerate(bodies)}


def _in_image(mask: Mask, part: Slices, shape: tuple[int, ...]) -> Mask:
    out = np.zeros(shape, bool)
    out[part] = mask
    return out


def _owners(tone: Tones, union: Mask, bodies: Sequence[tuple[SkyBody, Corner]]) -> NDArray[np.int8]:
    """Number of the body that owns each pixel, (h, w); -1 for none.

    Args:
        tone: (h, w) uint8, a part of the image.
        union: (h, w) bool: bright pixels that they share.
        bodies: With the corners of their boxes in this part.
    """
    owner = np.full(union.shape, -1, np.int8)
    cost = np.full(union.shape, np.inf, np.float32)
    for k, (body, at) in enumerate(bodies):
        unlike = _difference(tone, union, body, at)
        better = unlike < cost
        owner[better] = k
        cost[better] = unlike[better]
    left = union & (owner < 0)
    if len(bodies) > 1 and left.any():
        owner[left] = _nearest([owner == k for k in range(len(bodies))])[left]
    return owner


def _difference(tone: Tones, union: Mask, body: SkyBody, corner: Corner) -> NDArray[np.float32]:
    """Smoothed difference of levels between the image and a body's look, (h, w) float32; infinite outside."""
    out = np.full(tone.shape, np.inf, np.float32)
    inside, part = overlap(body.look, corner, (tone.shape[0], tone.shape[1]))
    mine = union[inside] & body.look.mask[part]
    if body.cut:
        out[inside][mine] = COVERS
        return out
    gap = cv2.absdiff(tone[inside], np.ascontiguousarray(body.look.tone[part]))
    smooth = np.asarray(cv2.blur(gap, (WINDOW, WINDOW)), np.float32)
    out[inside][mine] = smooth[mine]
    return out


def _nearest(masks: Sequence[Mask]) -> NDArray[np.int8]:
    """The nearest body to each pixel, of those that are seen."""
    nearest = np.zeros(masks[0].shape, np.int8)
    least = np.full(masks[0].shape, np.inf, np.float32)
    for k, mask in enumerate(masks):
        if mask.any():
            far = cv2.distanceTransform((~mask).view(np.uint8), cv2.DIST_L2, 3)
            nearer = far < least
            nearest[nearer] = k
            least[nearer] = far[nearer]
    return nearest

"""Bodies that touch or cover each other in the image share one bright component: who owns which pixel."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.percepts.motion.dark_sky.body import Corner, SkyBody, overlap, pasted
from visup.percepts.motion.dark_sky.sky import Mask

Tones = NDArray[np.uint8]

REACH = 4  # pixels around the expected place where a body is looked for
ALIKE = 30.0  # root mean square difference of levels up to which a body is found again
WINDOW = 9  # pixels: side of the window in which the differences of two bodies are compared


def placed(tone: Tones, body: SkyBody, now: float) -> Corner:
    """The corner of a body's box in a picture where it touches others: where its look fits best.

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
        return x, y
    weight = body.look.mask.view(np.uint8)
    cost = cv2.matchTemplate(window, body.look.tone, cv2.TM_SQDIFF, mask=weight)
    least, _, at, _ = cv2.minMaxLoc(cost)
    return (left + at[0], top + at[1]) if least <= ALIKE**2 * body.area else (x, y)


def split(
    tone: Tones, union: Mask, bodies: Sequence[SkyBody], corners: Sequence[Corner]
) -> Mapping[int, Mask]:
    """Share bright pixels among bodies that touch in the image.

    Where the looks of several lie, the one that is more like the pixels there is in front. Pixels of none go to
    the nearest body that the border cuts, since more of it may have come into view, else to the nearest
    one; with a single body they are something that is not known.

    Args:
        tone: (H, W) uint8.
        union: (H, W) bool: bright pixels of the components that they share.
        bodies: At least one.
        corners: Where the box of each lies.

    Returns:
        Key -> (H, W) bool.
    """
    shape = (tone.shape[0], tone.shape[1])
    pairs = list(zip(bodies, corners, strict=True))
    masks = [pasted(b.look, at, shape) & union for b, at in pairs]
    owner = _in_front(masks, [_difference(tone, b, at) for b, at in pairs])
    left = union & (owner < 0)
    if len(bodies) > 1 and left.any():
        owner[left] = _nearest([owner == k for k in range(len(bodies))], bodies)[left]
    return {b.key: union & (owner == k) for k, b in enumerate(bodies)}


def _difference(tone: Tones, body: SkyBody, corner: Corner) -> NDArray[np.float32]:
    """Smoothed difference of levels between the image and a body's look, (H, W) float32."""
    out = np.full(tone.shape, 255, np.float32)
    inside, part = overlap(body.look, corner, (tone.shape[0], tone.shape[1]))
    out[inside] = cv2.absdiff(tone[inside], np.ascontiguousarray(body.look.tone[part]))
    return np.asarray(cv2.blur(out, (WINDOW, WINDOW)), np.float32)


def _in_front(masks: Sequence[Mask], unlike: Sequence[NDArray[np.float32]]) -> NDArray[np.int64]:
    """The body that lies in front at each pixel, -1 for none, (H, W)."""
    cost = np.stack([np.where(m, u, np.inf) for m, u in zip(masks, unlike, strict=True)])
    return np.where(np.isfinite(cost.min(axis=0)), cost.argmin(axis=0), -1)


def _nearest(masks: Sequence[Mask], bodies: Sequence[SkyBody]) -> NDArray[np.int64]:
    """The nearest body to each pixel, among those that the border cuts if there are any."""
    some = [k for k, m in enumerate(masks) if m.any()]
    some = [k for k in some if bodies[k].cut] or some or [0]
    far = [cv2.distanceTransform((~masks[k]).view(np.uint8), cv2.DIST_L2, 3) for k in some]
    return np.asarray(some)[np.argmin(far, axis=0)]

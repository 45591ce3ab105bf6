"""Division of a bright component among bodies that touch or occlude each other in the image."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.percepts.motion.dark_sky.body import BodyLook, Corner, SkyBody, Slices, overlap
from visup.percepts.motion.dark_sky.sky import Mask

Tones = NDArray[np.uint8]

REACH = 4  # search range around the predicted position, pixels
ALIKE = 30.0  # greatest RMS difference of levels at which a template matches
STRAY = 10.0  # penalty on the mean squared difference per squared pixel from the predicted position
FEW = 16  # fewest pixels on which templates are compared
HELD = 0.7  # factor on the difference of a body that was in front of the other one before

_STEPS = np.arange(-REACH, REACH + 1, dtype=np.float32) ** 2
_FAR = _STEPS[:, None] + _STEPS
"""Squared distances of the searched positions from the predicted one, pixels."""


@dataclass(frozen=True, slots=True, eq=False)
class Share:
    """The part of a component that belongs to a body.

    Attributes:
        mask: (H, W) bool, its visible pixels.
        covers: Keys of the bodies behind it.
    """

    mask: Mask
    covers: frozenset[int]


def placed(tone: Tones, body: SkyBody, now: float) -> tuple[Corner, bool]:
    """Locate a body that touches others, by matching its template near the predicted position.

    Args:
        tone: (H, W) uint8, brightness of the frame.
        body: The body.
        now: Time of the frame, seconds.

    Returns:
        The corner (x, y) of its box, frame pixels, and whether the template matches there; if it matches
        nowhere, the predicted corner and False.
    """
    x, y = body.expected(now)
    look, (dx, dy) = _within(body.look, (x, y), tone.shape)
    h, w = look.mask.shape
    window = tone[y + dy - REACH : y + dy + h + REACH, x + dx - REACH : x + dx + w + REACH]
    area = np.count_nonzero(look.mask)
    if area < FEW or window.shape != (h + 2 * REACH, w + 2 * REACH):
        return (x, y), False
    cost = cv2.matchTemplate(window, look.tone, cv2.TM_SQDIFF, mask=look.mask.view(np.uint8)) / area
    _, _, at, _ = cv2.minMaxLoc(cost + STRAY * _FAR)
    fits = bool(cost[at[1], at[0]] <= ALIKE**2)
    return ((x - REACH + at[0], y - REACH + at[1]) if fits else (x, y)), fits


def _within(look: BodyLook, corner: Corner, shape: tuple[int, ...]) -> tuple[BodyLook, Corner]:
    """The part of a template that stays in the image at all searched positions, and its offset (x, y)."""
    x, y = corner
    h, w = look.mask.shape
    left, top = max(REACH - x, 0), max(REACH - y, 0)
    right, bottom = min(w, shape[1] - REACH - x), min(h, shape[0] - REACH - y)
    part = np.s_[top : max(bottom, top), left : max(right, left)]
    tone, mask = np.ascontiguousarray(look.tone[part]), np.ascontiguousarray(look.mask[part])
    return BodyLook(mask, tone, look.corner), (left, top)


def split(
    tone: Tones, union: Mask, bodies: Sequence[SkyBody], corners: Sequence[Corner]
) -> tuple[Share, ...]:
    """Divide the bright pixels of a component among bodies that touch in the image.

    Where the templates of two bodies overlap, the one that matches the pixels better is in front. Pixels
    outside of all templates go to the nearest body; if there is only one body, they are left unassigned,
    since they show something unknown that has joined it.

    Args:
        tone: (H, W) uint8, brightness of the frame.
        union: (H, W) bool, bright pixels of the component that the bodies share.
        bodies: At least one body.
        corners: (x, y) of the box of each, frame pixels, from `placed`.

    Returns:
        The share of each body, in order.
    """
    x, y, w, h = cv2.boundingRect(union.view(np.uint8))
    part = np.s_[y : y + h, x : x + w]
    places = [
        _PlacedLook(b, (at[0] - x, at[1] - y), union[part])
        for b, at in zip(bodies, corners, strict=True)
    ]
    fronts = [frozenset(_behind(p, places, tone[part])) for p in places]
    owner = np.full((h, w), -1, np.int8)
    for k in sorted(range(len(places)), key=lambda k: (len(fronts[k]), -bodies[k].key)):
        owner[places[k].mask] = k
    left = union[part] & (owner < 0)
    if len(bodies) > 1 and left.any():
        owner[left] = _nearest([owner == k for k in range(len(bodies))])[left]
    masks = [_in_image(owner == k, part, union.shape) for k in range(len(bodies))]
    return tuple(Share(m, f) for m, f in zip(masks, fronts, strict=True))


class _PlacedLook:
    """The template of a body placed in a window of the image.

    Attributes:
        body: The body.
        corner: (x, y) of its box in the window.
        mask: (h, w) bool, the bright pixels of the window that the template covers.
    """

    def __init__(self, body: SkyBody, corner: Corner, bright: Mask) -> None:
        self.body, self.corner = body, corner
        self.mask = np.zeros(bright.shape, bool)
        inside, part = overlap(body.look, corner, (bright.shape[0], bright.shape[1]))
        self.mask[inside] = body.look.mask[part] & bright[inside]

    def unlike(self, tone: Tones, where: Mask) -> float:
        """Mean absolute difference of levels between window and template over `where`, (h, w) bool."""
        inside, part = overlap(self.body.look, self.corner, (tone.shape[0], tone.shape[1]))
        gap = cv2.absdiff(tone[inside], np.ascontiguousarray(self.body.look.tone[part]))
        return float(gap[where[inside]].mean())


def _behind(one: _PlacedLook, places: Sequence[_PlacedLook], tone: Tones) -> list[int]:
    """Keys of the bodies that are behind `one`."""
    return [o.body.key for o in places if o is not one and _covers(one, o, tone)]


def _covers(one: _PlacedLook, other: _PlacedLook, tone: Tones) -> bool:
    """Whether one body is in front of another: its template matches better where both overlap.

    If they hardly overlap, the order is as in the last frame; ties go to the larger body.
    """
    before, after = other.body.key in one.body.covers, one.body.key in other.body.covers
    both = one.mask & other.mask
    if np.count_nonzero(both) < FEW:
        return before
    mine = one.unlike(tone, both) * (HELD if before else 1)
    yours = other.unlike(tone, both) * (HELD if after else 1)
    return (mine, -one.body.area) < (yours, -other.body.area)


def _in_image(mask: Mask, part: Slices, shape: tuple[int, ...]) -> Mask:
    out = np.zeros(shape, bool)
    out[part] = mask
    return out


def _nearest(masks: Sequence[Mask]) -> NDArray[np.int8]:
    """(h, w) int8: index of the nearest non-empty mask to each pixel."""
    nearest = np.zeros(masks[0].shape, np.int8)
    least = np.full(masks[0].shape, np.inf, np.float32)
    for k, mask in enumerate(masks):
        if mask.any():
            far = cv2.distanceTransform((~mask).view(np.uint8), cv2.DIST_L2, 3)
            nearer = far < least
            nearest[nearer] = k
            least[nearer] = far[nearer]
    return nearest

"""Division of a bright component among bodies that touch or occlude each other in the image."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.percepts.motion.dark_sky.body import (
    BodyTemplate,
    Corner,
    SkyBody,
    Slices,
    template_overlap,
)
from visup.percepts.motion.dark_sky.sky import Mask

Tones = NDArray[np.uint8]

REACH = 4  # search range around the predicted position, pixels
MAX_DIFFERENCE = 30.0  # greatest RMS difference of levels at which a template matches
DISTANCE_PENALTY = 10.0
"""Added to the mean squared difference per squared pixel from the predicted position."""
FEWEST_PIXELS = 16  # fewest pixels on which templates are compared
WAS_IN_FRONT_FACTOR = 0.7
"""Factor on the difference of a body that was in front of the other one before."""

_STEPS = np.arange(-REACH, REACH + 1, dtype=np.float32) ** 2
_SQUARED_DISTANCES = _STEPS[:, None] + _STEPS
"""Squared distances of the searched positions from the predicted one, pixels."""


@dataclass(frozen=True, slots=True, eq=False)
class ComponentShare:
    """The part of a component that belongs to a body.

    Attributes:
        mask: (H, W) bool, its visible pixels.
        occludes: Keys of the bodies behind it.
    """

    mask: Mask
    occludes: frozenset[int]


def locate(tone: Tones, body: SkyBody, now: float) -> tuple[Corner, bool]:
    """Locate a body that touches others, by matching its template near the predicted position.

    Args:
        tone: (H, W) uint8, brightness of the frame.
        body: The body.
        now: Time of the frame, seconds.

    Returns:
        The corner (x, y) of its box, frame pixels, and whether the template matches there; if it matches
        nowhere, the predicted corner and False.
    """
    x, y = body.predicted_corner(now)
    template, (dx, dy) = _inside_image(body.template, (x, y), tone.shape)
    h, w = template.mask.shape
    window = tone[y + dy - REACH : y + dy + h + REACH, x + dx - REACH : x + dx + w + REACH]
    area = np.count_nonzero(template.mask)
    if area < FEWEST_PIXELS or window.shape != (h + 2 * REACH, w + 2 * REACH):
        return (x, y), False
    cost = (
        cv2.matchTemplate(window, template.tone, cv2.TM_SQDIFF, mask=template.mask.view(np.uint8))
        / area
    )
    _, _, at, _ = cv2.minMaxLoc(cost + DISTANCE_PENALTY * _SQUARED_DISTANCES)
    fits = bool(cost[at[1], at[0]] <= MAX_DIFFERENCE**2)
    return ((x - REACH + at[0], y - REACH + at[1]) if fits else (x, y)), fits


def _inside_image(
    template: BodyTemplate, corner: Corner, shape: tuple[int, ...]
) -> tuple[BodyTemplate, Corner]:
    """The part of a template that stays in the image at all searched positions, and its offset (x, y)."""
    x, y = corner
    h, w = template.mask.shape
    left, top = max(REACH - x, 0), max(REACH - y, 0)
    right, bottom = min(w, shape[1] - REACH - x), min(h, shape[0] - REACH - y)
    part = np.s_[top : max(bottom, top), left : max(right, left)]
    tone, mask = (
        np.ascontiguousarray(template.tone[part]),
        np.ascontiguousarray(template.mask[part]),
    )
    return BodyTemplate(mask, tone, template.corner), (left, top)


def split_component(
    tone: Tones, union: Mask, bodies: Sequence[SkyBody], corners: Sequence[Corner]
) -> tuple[ComponentShare, ...]:
    """Divide the bright pixels of a component among bodies that touch in the image.

    Where the templates of two bodies overlap, the one that matches the pixels better is in front. Pixels
    outside of all templates go to the nearest body; if there is only one body, they are left unassigned,
    since they show something unknown that has joined it.

    Args:
        tone: (H, W) uint8, brightness of the frame.
        union: (H, W) bool, bright pixels of the component that the bodies share.
        bodies: At least one body.
        corners: (x, y) of the box of each, frame pixels, from `locate`.

    Returns:
        The share of each body, in order.
    """
    x, y, w, h = cv2.boundingRect(union.view(np.uint8))
    part = np.s_[y : y + h, x : x + w]
    placed_templates = [
        _PlacedTemplate(b, (at[0] - x, at[1] - y), union[part])
        for b, at in zip(bodies, corners, strict=True)
    ]
    occluded = [frozenset(_behind(p, placed_templates, tone[part])) for p in placed_templates]
    owner = np.full((h, w), -1, np.int8)
    for k in sorted(range(len(placed_templates)), key=lambda k: (len(occluded[k]), -bodies[k].key)):
        owner[placed_templates[k].mask] = k
    unassigned = union[part] & (owner < 0)
    if len(bodies) > 1 and unassigned.any():
        owner[unassigned] = _nearest([owner == k for k in range(len(bodies))])[unassigned]
    masks = [_in_image(owner == k, part, union.shape) for k in range(len(bodies))]
    return tuple(ComponentShare(m, f) for m, f in zip(masks, occluded, strict=True))


class _PlacedTemplate:
    """The template of a body, placed in a window of the image.

    Attributes:
        body: The body.
        corner: (x, y) of its box in the window.
        mask: (h, w) bool, the bright pixels of the window that the template covers.
    """

    def __init__(self, body: SkyBody, corner: Corner, bright: Mask) -> None:
        self.body, self.corner = body, corner
        self.mask = np.zeros(bright.shape, bool)
        inside, part = template_overlap(body.template, corner, (bright.shape[0], bright.shape[1]))
        self.mask[inside] = body.template.mask[part] & bright[inside]

    def difference(self, tone: Tones, where: Mask) -> float:
        """Mean absolute difference of levels between window and template over `where`, (h, w) bool."""
        inside, part = template_overlap(
            self.body.template, self.corner, (tone.shape[0], tone.shape[1])
        )
        gap = cv2.absdiff(tone[inside], np.ascontiguousarray(self.body.template.tone[part]))
        return float(gap[where[inside]].mean())


def _behind(
    one: _PlacedTemplate, placed_templates: Sequence[_PlacedTemplate], tone: Tones
) -> list[int]:
    """Keys of the bodies that are behind `one`."""
    return [o.body.key for o in placed_templates if o is not one and _is_in_front(one, o, tone)]


def _is_in_front(one: _PlacedTemplate, other: _PlacedTemplate, tone: Tones) -> bool:
    """Whether one body is in front of another: its template matches better where both overlap.

    If they hardly overlap, the order is as in the last frame; ties go to the larger body.
    """
    was_in_front, was_behind = (
        other.body.key in one.body.occludes,
        one.body.key in other.body.occludes,
    )
    both = one.mask & other.mask
    if np.count_nonzero(both) < FEWEST_PIXELS:
        return was_in_front
    cost = one.difference(tone, both) * (WAS_IN_FRONT_FACTOR if was_in_front else 1)
    other_cost = other.difference(tone, both) * (WAS_IN_FRONT_FACTOR if was_behind else 1)
    return (cost, -one.body.area) < (other_cost, -other.body.area)


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

"""Quantities of outlines: orientation, openness and how much of one lies along another."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from itertools import combinations
from types import MappingProxyType

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.agent import ObjectBelief, Presence
from visup.rules.formula.truth import MAYBE, NO, YES
from visup.rules.geometry.borders import common_border
from visup.rules.geometry.regions import image_diagonal
from visup.rules.predicates.snapshot import Codes, Floats, Snapshot, exact

MIN_ELONGATION = 1.3
"""Least ratio of length to width for a meaningful long axis."""

ALIGNED_DEG = 10.0
"""Axes that differ by less are aligned; by more than `APART_DEG` they are not; in between is unknown."""
APART_DEG = 15.0


def orientation(facts: Snapshot) -> Floats:
    """Orientation of each long axis, degrees from 0 to 180: 0 horizontal, 90 vertical; unknown when round."""
    return exact(_axes(facts))


def axis_angle(facts: Snapshot) -> Floats:
    """Angle between the long axes of all pairs, degrees from 0 to 90; unknown if one is round."""
    angles = _angles_between(_axes(facts))
    known = np.isfinite(angles)
    return np.array((np.where(known, angles, -np.inf), np.where(known, angles, np.inf)))


def aligned(facts: Snapshot) -> Codes:
    """Whether the long axes of two objects are parallel."""
    angles = _angles_between(_axes(facts))
    with np.errstate(invalid="ignore"):
        codes = np.where(angles <= ALIGNED_DEG, YES, np.where(angles >= APART_DEG, NO, MAYBE))
    return codes.astype(np.int8)


OUTLINE_RELATIONS: Mapping[str, tuple[Callable[[Snapshot], Codes], str]] = MappingProxyType(
    {"aligned": (aligned, "their long axes point the same way in the image")}
)
"""Word -> its evaluation, and its meaning in one clause."""


def openness(facts: Snapshot) -> Floats:
    """Free share of each outline's convex hull, 0 to 1: for jaws, a door, scissors."""
    return exact(np.array([_openness(b) for b in facts.beliefs], dtype=float))


def shared_outline(facts: Snapshot) -> Floats:
    """Share of one outline that lies along the other, of all pairs, 0 to 1: the greater one of the two.

    One lies along the other where their gap is one at which two touch. Unknown if one is out of view.
    """
    beliefs = facts.beliefs
    near = facts.relation_settings.touch_enter * image_diagonal(facts.mind.frame_size)
    low = np.full((len(beliefs), len(beliefs)), -np.inf)
    high = -low
    seen = [k for k, b in enumerate(beliefs) if b.presence is Presence.SEEN]
    for i, j in combinations(seen, 2):
        share = common_border(beliefs[i].region, beliefs[j].region, near)
        low[i, j] = low[j, i] = high[i, j] = high[j, i] = share
    return np.array((low, high))


def _axes(facts: Snapshot) -> NDArray[np.float64]:
    """(n,) orientation of the long axis of each visible object, degrees; NaN without one."""
    return np.array([_axis(b) for b in facts.beliefs], dtype=float)


def _axis(belief: ObjectBelief) -> float:
    if belief.presence is not Presence.SEEN or len(belief.region.contour) < 3:
        return np.nan
    m = cv2.moments(np.asarray(belief.region.contour, dtype=np.float32))
    if m["m00"] <= 0:
        return np.nan
    xx, xy, yy = (m[k] / m["m00"] for k in ("mu20", "mu11", "mu02"))
    mean, spread = (xx + yy) / 2, np.hypot((xx - yy) / 2, xy)
    if mean + spread < MIN_ELONGATION**2 * max(mean - spread, 1e-9):
        return np.nan
    return float(np.degrees(0.5 * np.arctan2(-2 * xy, xx - yy)) % 180.0)


def _angles_between(axes: NDArray[np.float64]) -> NDArray[np.float64]:
    difference = np.abs(axes[:, None] - axes[None]) % 180.0
    angles: NDArray[np.float64] = np.minimum(difference, 180.0 - difference)
    return angles


def _openness(belief: ObjectBelief) -> float:
    if belief.presence is not Presence.SEEN or len(belief.region.contour) < 3:
        return np.nan
    outline = np.asarray(belief.region.contour, dtype=np.float32)
    hull = float(cv2.contourArea(cv2.convexHull(outline)))
    return 1.0 - float(cv2.contourArea(outline)) / hull if hull > 0 else np.nan

"""Motion onset: bodies that begin to move, as a whole or in part, independently of the camera.

The tip of an articulated body moves long before the whole: the centre of an arm hardly moves while its hand
approaches. The support function of the outline (its extent in each direction) shows both. Motion common to
all bodies is due to the camera, so each is compared with the median of the others.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from visup.agent import Mind
from visup.rules.geometry.regions import Floats, image_diagonal
from visup.rules.relations.kinematics import Kinematics
from visup.rules.relations.reasoner import kinematics, relation_settings, sample_window
from visup.rules.relations.samples import SampleWindow

LAG_S = 0.4
"""Interval over which the change of an outline is measured, seconds."""

MIN_ADVANCE = 0.012
"""Least change of an outline's extent, image diagonals. In rendered worlds of ten kinds outlines change by at
most 0.009 before anything moves, and a robot's by 0.03 within 0.6 s after it sets out."""

MIN_RATIO = 2.0
"""Least ratio of the change of a slow body's extent to that of some other body for it to move by itself: a
swaying camera moves all bodies alike, but for parallax."""

MOVING_SIGMAS = 3.0
"""Least speed of a moving body, in standard deviations of its velocity."""

SETTING_OUT = 0.0125
"""Least speed of a body that sets out, image diagonals per second: one that only shifts is slower."""

Mask = NDArray[np.bool_]


def moving_bodies(mind: Mind, least: float = 0.0) -> frozenset[int]:
    """Ids of the bodies that move by themselves now, as a whole or in part.

    Args:
        mind: The mind.
        least: Least speed of one that moves as a whole, image diagonals per second, if that is more than the
            greatest of a body at rest.
    """
    diagonal = image_diagonal(mind.frame_size)
    now, window = kinematics(mind), sample_window(mind)
    if window.ids != now.ids or not len(window.times):
        return frozenset()
    settings = relation_settings(mind)
    still, slow = max(least, settings.still_speed) * diagonal, settings.slow_speed * diagonal
    beside = near_movers(now, slow, settings.covering_gap * diagonal)
    limits = np.where(beside, max(still, slow), still)
    moving_slowly = moving(now, limits) & moving_more_than_others(window)
    is_moving = moving_slowly | advancing_outlines(window, MIN_ADVANCE * diagonal)
    return frozenset(i for i, moves in zip(now.ids, is_moving.tolist(), strict=True) if moves)


def near_movers(now: Kinematics, slow: float, gap: float) -> Mask:
    """Bodies beside others that are not known to be slow, which may cover or shade them.

    Args:
        now: The present quantities.
        slow: Speed below which a body is slow, pixels per second.
        gap: Distance up to which one is beside another, pixels.

    Returns:
        (M,) bool.
    """
    with np.errstate(invalid="ignore"):
        fast = ~(now.speed < slow)
        near = now.gap < gap
    np.fill_diagonal(near, False)
    return np.asarray((near & fast).any(axis=1))


def moving(now: Kinematics, still: Floats) -> Mask:
    """(M,) bool: the bodies that move faster than `still`, pixels per second, and than noise explains.

    Args:
        now: The present quantities.
        still: (M,) greatest speed of each body at rest, pixels per second.
    """
    with np.errstate(invalid="ignore"):
        return np.asarray(now.speed > np.maximum(still, MOVING_SIGMAS * now.velocity_sigma))


def moving_more_than_others(window: SampleWindow) -> Mask:
    """Bodies whose outlines have changed their extent much more than that of some other body.

    Args:
        window: The last samples.

    Returns:
        (M,) bool over the bodies of the window; True for a single one.
    """
    reach, free = window.steady_support, window.free
    most = np.where(free, reach, -np.inf).max(axis=0)
    spans = most - np.where(free, reach, np.inf).min(axis=0)
    span = np.where(free.any(axis=0), spans, 0.0).max(axis=1)
    # The span of one that has just come in is small, whatever moves.
    known = free[0].any(axis=1) & free[-1].any(axis=1)
    found = np.ones(len(span), dtype=bool)
    for i in range(len(span)):
        others = np.delete(span, i)[np.delete(known, i)]
        found[i] = not len(others) or span[i] > MIN_RATIO * others.min()
    return found


def advancing_outlines(window: SampleWindow, limit: float) -> Mask:
    """Bodies whose outlines have just advanced in some direction, unlike those of the others.

    The outline of a moving body advances on at least one side; that of a body being covered only recedes.

    Args:
        window: The last samples.
        limit: Least change, pixels.

    Returns:
        (M,) bool over the bodies of the window.
    """
    times = window.times
    if times[-1] - times[0] < LAG_S - 1e-6:
        return np.zeros(len(window.ids), dtype=bool)
    then = int(times.searchsorted(times[-1] - LAG_S + 1e-6, side="right")) - 1
    known = window.free[-1] & window.free[then]
    reach = window.steady_support
    change = np.where(known, reach[-1] - reach[then], np.nan)
    farther = change - _medians_of_others(change)
    with np.errstate(invalid="ignore"):
        return np.asarray(((change > limit) & (farther > limit)).any(axis=1))


def _medians_of_others(values: Floats) -> Floats:
    """(M, K) medians of the values of all other bodies; 0 where no other is known."""
    found = np.zeros_like(values)
    for i in range(len(values)):
        others = np.delete(values, i, axis=0)
        known = (~np.isnan(others)).any(axis=0)
        found[i, known] = np.nanmedian(others[:, known], axis=0)
    return found

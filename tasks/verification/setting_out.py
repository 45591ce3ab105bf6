"""Who sets out: bodies that begin to move, as a whole or by a part, and not with the whole picture.

A body of links moves by its tip long before it moves as a whole: the middle of an arm hardly does while
its hand is on the way. How far an outline reaches to each side tells of both. What all bodies do
alike is the camera's doing: each is compared with the median of the others.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from visup.agent import Mind
from visup.rules.geometry.regions import Floats, image_diagonal
from visup.rules.relations.kinematics import Kinematics, RelationSettings
from visup.rules.relations.reasoner import kinematics, sample_window
from visup.rules.relations.samples import SampleWindow

LAG_S = 0.4
"""Over how long an outline must have changed its reach."""

REACH = 0.012
"""By how much it must have, image diagonals. In rendered worlds of ten kinds outlines change by at most 0.009
before anything moves, and a robot's by 0.03 within 0.6 s after it sets out."""

FARTHER = 2.0
"""A body that moves slowly moves by itself where it has come so many times as far as another: a camera that
sways moves all alike, but for parallax."""

MOVING_SIGMAS = 3.0
"""By how many standard deviations a body must move to be seen to."""

Marks = NDArray[np.bool_]


def setting_out(mind: Mind) -> frozenset[int]:
    """Ids of the bodies that move by themselves now, or of which a part does."""
    diagonal = image_diagonal(mind.frame_size)
    now, window = kinematics(mind), sample_window(mind)
    if window.ids != now.ids or not len(window.times):
        return frozenset()
    slowly = moving(now, RelationSettings().still_speed * diagonal)
    slowly &= farther_than_others(window)
    moves = slowly | reaching_out(window, REACH * diagonal)
    return frozenset(i for i, sets_out in zip(now.ids, moves.tolist(), strict=True) if sets_out)


def moving(now: Kinematics, still: float) -> Marks:
    """(M,) the bodies that move faster than `still`, pixels per second, and than noise makes them."""
    with np.errstate(invalid="ignore"):
        return np.asarray(now.speed > np.maximum(still, MOVING_SIGMAS * now.velocity_sigma))


def farther_than_others(window: SampleWindow) -> Marks:
    """Bodies whose outlines have changed their reach well more than that of some other body has.

    Args:
        window: The last samples.

    Returns:
        (M,) of all bodies of the window; also of one that is alone.
    """
    reach, free = window.steady_support, window.free
    most = np.where(free, reach, -np.inf).max(axis=0)
    spans = most - np.where(free, reach, np.inf).min(axis=0)
    span = np.where(free.any(axis=0), spans, 0.0).max(axis=1)
    known = free.any(axis=(0, 2))
    found = np.ones(len(span), dtype=bool)
    for i in range(len(span)):
        others = np.delete(span, i)[np.delete(known, i)]
        found[i] = not len(others) or span[i] > FARTHER * others.min()
    return found


def reaching_out(window: SampleWindow, limit: float) -> Marks:
    """Bodies whose outlines have just changed how far they reach, and otherwise than the rest.

    Args:
        window: The last samples.
        limit: By how much, pixels.

    Returns:
        (M,) of all bodies of the window.
    """
    times = window.times
    if times[-1] - times[0] < LAG_S - 1e-6:
        return np.zeros(len(window.ids), dtype=bool)
    then = int(times.searchsorted(times[-1] - LAG_S + 1e-6, side="right")) - 1
    known = window.free[-1] & window.free[then]
    reach = window.steady_support
    change = np.where(known, reach[-1] - reach[then], np.nan)
    apart = np.abs(change - _of_others(change))
    with np.errstate(invalid="ignore"):
        return np.asarray(((np.abs(change) > limit) & (apart > limit)).any(axis=1))


def _of_others(values: Floats) -> Floats:
    """(M, K) medians of the same values of all others; 0 where nobody else's is known."""
    found = np.zeros_like(values)
    for i in range(len(values)):
        others = np.delete(values, i, axis=0)
        known = (~np.isnan(others)).any(axis=0)
        found[i, known] = np.nanmedian(others[:, known], axis=0)
    return found

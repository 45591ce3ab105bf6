"""Trends that have just set in and are significant, although they have not lasted yet.

A trend counts once it has lasted (`trend.py`), which is late for the beginning of a stage. Where the
distance of two bodies changes much faster than its noise, a few samples are sufficient (`rise.py`).
"""

from __future__ import annotations

from collections.abc import Iterable
from math import sqrt

import numpy as np

from visup.agent import Mind, Relation, Truth
from visup.rules.geometry.regions import image_diagonal
from visup.rules.geometry.rise import RiseLimits, sudden_rise
from visup.rules.relations.reasoner import kinematics, relation_settings, sample_window
from visup.rules.relations.trend import SIGNS

OPPOSITE = {"converging": "diverging", "diverging": "converging"}

MIN_CHANGE = 0.0067
"""Least change of the distance, image diagonals: four pixels in an image of 480 x 360. Closing fingers change
it by two."""

SWAY_SHARE = 0.2
"""Least rate, as a share of the speed of the slower body: a carried body sways and rotates."""

CONFIDENCE = 0.7
"""Confidence of a trend that has not lasted yet."""


class NewTrends:
    """The sudden trends of one moment, each computed once.

    Args:
        mind: The mind.
    """

    def __init__(self, mind: Mind) -> None:
        self._mind = mind
        self._found: dict[tuple[str, tuple[int, ...]], Relation | None] = {}

    def first_new(self, names: Iterable[str], ids: tuple[int, ...]) -> Relation | None:
        """The first of some relations that is a trend which has just set in, or None.

        The object named first is the one that should come or go: while only the other one moves, a trend must
        last to count.
        """
        found = (self._trend(name, ids) for name in names if name in SIGNS)
        sudden = next((t for t in found if t is not None), None)
        return None if sudden is None or self._only_second_moves(ids) else sudden

    def has_opposite(self, relation: Relation) -> bool:
        """Whether a relation is a trend of which the opposite has just set in."""
        opposite = OPPOSITE.get(relation.name)
        return opposite is not None and self._trend(opposite, relation.objects) is not None

    def _trend(self, name: str, ids: tuple[int, ...]) -> Relation | None:
        if (name, ids) not in self._found:
            self._found[name, ids] = new_trend(self._mind, name, ids)
        return self._found[name, ids]

    def _only_second_moves(self, ids: tuple[int, ...]) -> bool:
        """Whether the second of two moves while the first one rests, as far as is known."""
        now, still = kinematics(self._mind), relation_settings(self._mind).still_speed
        still *= image_diagonal(self._mind.frame_size)
        return now.one("speed", ids[0]) < still < now.one("speed", ids[1])


def new_trend(mind: Mind, trend: str, ids: tuple[int, ...]) -> Relation | None:
    """A trend of the distance of two bodies that has just set in.

    Args:
        mind: The mind.
        trend: 'converging' or 'diverging'.
        ids: Two bodies.

    Returns:
        The trend since its onset, or None.
    """
    window, now = sample_window(mind), kinematics(mind)
    if len(ids) != 2 or not set(ids) <= set(window.ids) or not len(window.times):
        return None
    distance = window.steady_separation[:, window.ids.index(ids[0]), window.ids.index(ids[1])]
    known = ~np.isnan(distance)
    if not known[-1]:
        return None
    speeds = [v for v in (now.one("speed", i) for i in ids) if v == v]  # NaN is not equal to itself
    limits = RiseLimits(
        sqrt(2.0) * relation_settings(mind).thresholds.noise_px,
        MIN_CHANGE * image_diagonal(mind.frame_size),
        SWAY_SHARE * min(speeds, default=0.0),
    )
    at = sudden_rise(window.times[known], SIGNS[trend] * distance[known], limits)
    return None if at is None else Relation(trend, ids, Truth.TRUE, at, CONFIDENCE)

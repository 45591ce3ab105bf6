"""Trends of a distance: converging, keeping distance, diverging; in the image and in depth.

A trend is believed late by nature, since its slope must stand out from the noise over a window and last. Once
it is believed, the same samples tell better when it set in (`trend_onset`).
"""

from __future__ import annotations

import numpy as np

from visup.rules.geometry.bend import bend
from visup.rules.relations.samples import SampleWindow

CONVERGING, KEEPING, DIVERGING = 0, 1, 2
TREND_NAMES = ("converging", "keeping_distance", "diverging")

SIGNS = {"converging": -1.0, "diverging": 1.0}
"""Sign of the rate of change of the distance."""


def trend_onset(window: SampleWindow, a: int, b: int, trend: str) -> float | None:
    """The most probable time at which two bodies began to draw nearer or apart.

    Args:
        window: The last samples.
        a: Id of a body.
        b: Id of the other.
        trend: 'converging' or 'diverging'.

    Returns:
        Seconds; None if it does not lie within the window, or too little was seen.
    """
    if not {a, b} <= set(window.ids):
        return None
    distance = window.steady_separation[:, window.ids.index(a), window.ids.index(b)]
    known = ~np.isnan(distance)
    return bend(window.times[known], SIGNS[trend] * distance[known])

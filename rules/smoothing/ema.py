"""A little smoothing before states are judged, so that the first glance does not decide them.

A state that is judged for the first time is judged by the middle of its band; if a single noisy
sample did that, it could settle on the wrong side and change later though nothing moved.
"""

from __future__ import annotations

from math import exp

import numpy as np

from visup.compiled import compiled
from visup.rules.smoothing.hysteresis import Floats

TAU_S = 0.15
"""Time constant, seconds; less than the least duration of the states that are judged."""


def exponential_mean(before: Floats, now: Floats, seconds: float, jump: float) -> Floats:
    """An exponential mean that follows at once what is no noise.

    Args:
        before: The means so far, any shape; NaN where there is none.
        now: The new values, of the same shape; NaN where unknown.
        seconds: Since the step before.
        jump: Differences greater than this are motion: the mean begins anew.

    Returns:
        The means now; NaN where unknown now.
    """
    flat = _exponential_mean(before.reshape(-1), now.reshape(-1), new_share(seconds), jump)
    return flat.reshape(now.shape)


def new_share(seconds: float) -> float:
    """Share of a new value in the mean, so many seconds after the value before."""
    return 1.0 - exp(-seconds / TAU_S)


@compiled
def _exponential_mean(before: Floats, now: Floats, share: float, jump: float) -> Floats:
    means = np.empty(len(now))
    for k in range(len(now)):
        step = now[k] - before[k]
        means[k] = share * step + before[k] if abs(step) <= jump else now[k]
    return means

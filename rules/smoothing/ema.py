"""Exponential moving averages of quantities before states are derived from them.

The first state of a quantity is decided at the middle of its band; if a single noisy sample did that, the
state could start on the wrong side and change later although nothing moved.
"""

from __future__ import annotations

from math import exp

import numpy as np

from visup.compiled import compiled
from visup.rules.smoothing.hysteresis import Floats

TAU_S = 0.15
"""Time constant, seconds; shorter than the least duration of the derived states."""


def exponential_mean(before: Floats, now: Floats, seconds: float, jump: float) -> Floats:
    """An exponential moving average that follows jumps beyond the noise at once.

    Args:
        before: The means so far, any shape; NaN where there is none.
        now: The new values, of the same shape; NaN where unknown.
        seconds: Time since the previous step.
        jump: Differences greater than this are motion, and reset the average.

    Returns:
        The means now; NaN where unknown now.
    """
    flat = _exponential_mean(before.reshape(-1), now.reshape(-1), new_share(seconds), jump)
    return flat.reshape(now.shape)


def new_share(seconds: float) -> float:
    """Weight of a new value, by the time since the previous one."""
    return 1.0 - exp(-seconds / TAU_S)


@compiled
def _exponential_mean(before: Floats, now: Floats, share: float, jump: float) -> Floats:
    means = np.empty(len(now))
    for k in range(len(now)):
        step = now[k] - before[k]
        means[k] = share * step + before[k] if abs(step) <= jump else now[k]
    return means

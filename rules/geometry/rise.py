"""A sudden rise of a noisy series: a sequential test of rising against going on as before.

The likelihood ratio of the samples after a possible onset is added up, and its maximum over all onsets
compared with a threshold, as in Page's test (CUSUM). Noise is estimated from the samples before the onset.
One sample counts for a limited amount only, so that an outlier is no rise.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from visup.rules.geometry.regions import Floats

LONGEST_S = 0.45
"""A rise that takes longer is not sudden, seconds; a slow drift of outlines is none."""

BEFORE_S = 0.4
"""Least time for which it must be known how the series went before, seconds."""

KNOWN_S = 1.0
"""Longest time before the onset that tells how the series went, seconds."""

SPACING_S = 1.0 / 15.0
"""Samples nearer to each other than this share their noise, and count for less, seconds."""

MOST = 6.5
"""Greatest weight of one sample, nats: two are needed."""

ENOUGH = 12.0
"""Log likelihood ratio from which a rise is certain, nats. With noise of one deviation, and a rise chosen
among some six onsets, it is reached by chance less than once in ten thousand samples."""


class RiseLimits(NamedTuple):
    """What counts as a rise.

    Attributes:
        noise: Least standard deviation of a sample.
        height: Least rise, in the unit of the values.
        rate: Least rate of change beyond that before, per second.
    """

    noise: float
    height: float
    rate: float


def sudden_rise(times: Floats, values: Floats, limits: RiseLimits) -> float | None:
    """The time at which values have suddenly begun to rise, if they still do.

    Args:
        times: (N,) seconds, ascending.
        values: (N,) of any unit.
        limits: What counts as a rise.

    Returns:
        Seconds, the last sample before the rise; None if there is no such rise.
    """
    last = len(times) - 1
    first = int(np.searchsorted(times, times[-1] - LONGEST_S - 1e-9)) if last > 0 else 0
    if last < 2 or values[-1] - values[first:].min() < limits.height:
        return None
    if values[-1] - values[-2] <= 0.5 * limits.noise:
        return None
    least = int(np.searchsorted(times, times[0] + BEFORE_S - 1e-9))
    onsets = range(max(first, least, 3), last - 1)
    found = [(_evidence(times, values, k, limits), k) for k in onsets]
    most, onset = max(found, default=(0.0, 0))
    return float(times[onset]) if most > ENOUGH else None


def _evidence(times: Floats, values: Floats, onset: int, limits: RiseLimits) -> float:
    """Log likelihood ratio of rising since a sample against going on as before; 0 if too low or too slow."""
    slope, level, sigma = _line(times[: onset + 1], values[: onset + 1], limits.noise)
    passed = times[onset + 1 :] - times[onset]
    # What was falling may stop: only what exceeds the last value, too, is a rise.
    excess = values[onset + 1 :] - max(level, values[onset]) - max(0.0, slope) * passed
    rate = float(passed @ excess / (passed @ passed))
    if rate <= limits.rate or excess[-1] < limits.height:
        return 0.0
    ratio = (excess**2 - (excess - rate * passed) ** 2) / (2.0 * sigma**2)
    share = np.minimum(1.0, np.diff(times[onset:]) / SPACING_S)
    return float(share @ np.minimum(ratio, MOST))


def _line(times: Floats, values: Floats, noise: float) -> tuple[float, float, float]:
    """A line through the samples before an onset: slope, value at its end, deviation of a sample from it."""
    known = times > times[-1] - KNOWN_S
    t, v = times[known] - times[-1], values[known]
    off, mean = t - t.mean(), float(v.mean())
    slope = float(off @ v / (off @ off)) if len(t) > 1 else 0.0
    level = mean - slope * float(t.mean())
    left = v - level - slope * t
    spread = float(left @ left) / max(1, len(t) - 2)
    return slope, level, max(noise, math.sqrt(spread)) * math.sqrt(1.0 + 1.0 / len(t))

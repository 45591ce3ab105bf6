"""The bend of a noisy series: when its values begin to rise, or to rise faster."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from visup.rules.geometry.regions import Floats

MIN_SAMPLES = 6
SIDE = 2
"""Least samples before the bend, and after it."""


def bend(times: Floats, values: Floats) -> float | None:
    """The time at which values begin to rise, or to rise faster.

    Continuous lines with one bend are fitted, with the bend at each sample in turn. A straight line is
    preferred unless the bend is worth its two further parameters by the Bayesian information criterion.

    Args:
        times: (N,) seconds, ascending.
        values: (N,) of any unit.

    Returns:
        Seconds, or None if there is no such bend.
    """
    n = len(times)
    if n < MIN_SAMPLES:
        return None
    straight, _ = _fitted(times, values, None)
    best, at = math.inf, None
    for knot in times[SIDE : n - SIDE].tolist():
        misfit, (_, before, change) = _fitted(times, values, knot)
        if misfit < best:
            best, at = misfit, knot if change > 0.0 and before + change > 0.0 else None
    return at if n * math.log(straight / best) > 2.0 * math.log(n) else None


def _fitted(times: Floats, values: Floats, knot: float | None) -> tuple[float, NDArray[np.float64]]:
    """The sum of squared residuals, above zero, and the coefficients: value, slope, change of slope."""
    columns = [np.ones_like(times), times - times[0]]
    if knot is not None:
        columns.append(np.maximum(0.0, times - knot))
    design = np.stack(columns, axis=1)
    found, *_ = np.linalg.lstsq(design, values, rcond=None)
    residual = values - design @ found
    return float(residual @ residual) + 1e-9, found

"""Compiled loop of `snapshot.py`: quantities of all pairs."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from visup.compiled import compiled

Floats = NDArray[np.float64]

GAP, CLOSING, CONTACT, RELATIVE = range(4)
"""Indices of the quantities."""


@compiled
def pair_quantities(
    gap: Floats,
    rate: Floats,
    sigma: Floats,
    relative: Floats,
    sigmas: float,
    out: Floats,
    first: NDArray[np.int8],
) -> None:
    """Intervals of the quantities of each pair.

    Args:
        gap: (n, n) pixels; NaN where unknown, as in all.
        rate: (n, n) trend of the distance, pixels per second.
        sigma: (n, n) its standard deviation.
        relative: (n, n) relative speed, pixels per second.
        sigmas: Half width of intervals, standard deviations.
        out: (4, 2, n, n) output: intervals of the gap, the closing speed, the time to contact in seconds,
            and the relative speed; infinite where unknown.
        first: (n, n) output: whether the second is the first contact of the first. If there will be no
            contact, the first object counts, so that one always does.
    """
    n = len(gap)
    for i in range(n):
        best, soonest = -1, np.inf
        for j in range(n):
            d, r, s = gap[i, j], -rate[i, j], sigma[i, j]
            s = sigmas * s if s == s else 0.0  # NaN is not equal to itself
            _put(out[GAP], i, j, d, d)
            _put(out[CLOSING], i, j, r - s, r + s)
            _put(out[RELATIVE], i, j, relative[i, j], relative[i, j])
            first[i, j] = 0
            if d != d or r != r:
                _put(out[CONTACT], i, j, np.nan, np.nan)
                continue
            _put(out[CONTACT], i, j, _until(d, r + s), _until(d, r - s))
            if i != j:
                first[i, j] = -1
                likely = _until(d, r)
                if best < 0 or likely < soonest:
                    best, soonest = j, likely
        if best >= 0:
            first[i, best] = 1


@compiled
def _until(gap: float, closing: float) -> float:
    """Seconds until a gap closes at that speed."""
    if gap == 0.0:
        return 0.0
    return gap / closing if closing > 0.0 else np.inf


@compiled
def _put(out: Floats, i: int, j: int, low: float, high: float) -> None:
    out[0, i, j] = low if low == low else -np.inf
    out[1, i, j] = high if high == high else np.inf

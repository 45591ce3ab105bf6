"""Quantities of all pairs as rules compare them, in one compiled pass."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from visup.compiled import compiled

Floats = NDArray[np.float64]

GAP, CLOSING, CONTACT, RELATIVE = range(4)
"""Places among the quantities."""


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
    """What is known of each pair.

    Args:
        gap: (n, n) pixels; NaN where unknown, as of all.
        rate: (n, n) trend of the distance, pixels per second.
        sigma: (n, n) its standard deviation.
        relative: (n, n) relative speed, pixels per second.
        sigmas: To how many deviations an interval reaches.
        out: (4, 2, n, n) intervals of the gap, of the closing speed, of the seconds until outlines meet,
            and of the relative speed; infinite where unknown. Written.
        first: (n, n) codes: whether the second is what the first would meet first. Of several that
            are never met, the first one counts, so that one always does. Written.
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
    """Seconds until a gap is closed at that speed."""
    if gap == 0.0:
        return 0.0
    return gap / closing if closing > 0.0 else np.inf


@compiled
def _put(out: Floats, i: int, j: int, low: float, high: float) -> None:
    out[0, i, j] = low if low == low else -np.inf
    out[1, i, j] = high if high == high else np.inf

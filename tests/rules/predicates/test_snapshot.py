"""Facts of all objects at once: compiled loops beside the plain NumPy that they stand for."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from visup.rules.predicates._snapshot_jit import CLOSING, CONTACT, GAP, RELATIVE, pair_quantities

Floats = NDArray[np.float64]
NUMBERS = st.sampled_from((np.nan, 0.0, 1.0, 2.5, 40.0, -3.0))


def intervals(low: Floats, high: Floats) -> Floats:
    return np.array((np.where(np.isnan(low), -np.inf, low), np.where(np.isnan(high), np.inf, high)))


def contact(gap: Floats, closing: Floats) -> Floats:
    with np.errstate(invalid="ignore", divide="ignore"):
        times = np.where(closing > 0, gap / closing, np.inf)
    times[(gap == 0.0) & ~np.isnan(closing)] = 0.0
    times[np.isnan(closing) | np.isnan(gap)] = np.nan
    return times


def first_met(likely: Floats) -> list[list[int]]:
    codes = []
    for i, row in enumerate(likely):
        known = [j for j, t in enumerate(row) if t == t and j != i]
        first = min(known, key=lambda j: row[j], default=-1)
        codes.append([(1 if j == first else -1) if j in known else 0 for j in range(len(row))])
    return codes


@settings(max_examples=150, deadline=None)
@given(st.integers(0, 4), st.data())
def test_pair_quantities_equal_plain_numpy(n: int, data: st.DataObject) -> None:
    cells = st.lists(NUMBERS, min_size=n * n, max_size=n * n)
    gap, rate, sigma, relative = (
        np.array(data.draw(cells), dtype=float).reshape(n, n) for _ in range(4)
    )
    sigma = np.abs(sigma)
    out, first = np.empty((4, 2, n, n)), np.empty((n, n), np.int8)
    pair_quantities(gap, rate, sigma, relative, 2.0, out, first)
    spread = np.nan_to_num(2.0 * sigma)
    slow, fast = -rate - spread, -rate + spread
    assert np.array_equal(out[GAP], intervals(gap, gap))
    assert np.array_equal(out[RELATIVE], intervals(relative, relative))
    assert np.array_equal(out[CLOSING], intervals(slow, fast))
    assert np.array_equal(out[CONTACT], intervals(contact(gap, fast), contact(gap, slow)))
    assert first.tolist() == first_met(contact(gap, -rate))

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from visup.percepts.motion.features._products_jit import affine_product, smoothed_and_turned
from visup.percepts.motion.features.tone_histograms import BINS, SMOOTHING


@settings(deadline=None)
@given(st.integers(0, 1000), st.integers(0, 30), st.integers(1, 12), st.integers(1, 9))
def test_products_are_those_of_linear_algebra(seed: int, rows: int, deep: int, wide: int) -> None:
    rng = np.random.default_rng(seed)
    z, matrix = rng.normal(size=(rows, deep)), rng.normal(size=(deep, wide))
    offset = rng.normal(size=wide)
    found = affine_product(*(a.astype(np.float32) for a in (z, matrix, offset)))
    assert np.allclose(found, z @ matrix + offset, atol=1e-4)


@settings(deadline=None)
@given(st.integers(0, 1000), st.integers(1, 40))
def test_smoothing_turns_the_axes(seed: int, many: int) -> None:
    values = np.random.default_rng(seed).random((BINS, many))
    assert np.allclose(smoothed_and_turned(SMOOTHING, values), (SMOOTHING @ values).T)

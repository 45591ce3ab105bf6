"""Robust fits: exact on lines, deaf to outliers, right about the border."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from visup.rules.fit import binned, nanmedian, slopes_of_spans, theil_sen, velocity
from visup.rules.geometry import DIRECTIONS

some = settings(max_examples=50, deadline=None)
number = st.floats(-100, 100)


@some
@given(number, number, st.integers(4, 30))
def test_a_line_is_found_exactly(slope: float, offset: float, n: int) -> None:
    t = np.linspace(3.0, 5.0, n)
    found, sigma = theil_sen(t, (slope * t + offset)[:, None])
    assert found[0] == pytest.approx(slope, abs=1e-6)
    assert sigma[0] == pytest.approx(0.0, abs=1e-6)


@some
@given(number, st.integers(0, 2**32 - 1))
def test_a_quarter_of_wild_samples_moves_the_slope_little(slope: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    t = np.linspace(0.0, 1.5, 20)
    v = slope * t
    v[rng.choice(20, 4, replace=False)] += rng.uniform(50, 500, 4)
    assert theil_sen(t, v[:, None])[0][0] == pytest.approx(slope, abs=1e-6)


def test_sigma_is_that_of_the_slope() -> None:
    """Over many draws the slope scatters as its own sigma says, within a third."""
    rng = np.random.default_rng(4)
    t = np.linspace(0.0, 1.5, 16)
    slope, sigma = theil_sen(t, rng.normal(0.0, 0.7, (16, 2000)))
    assert np.median(sigma) == pytest.approx(slope.std(), rel=0.33)


@some
@given(st.lists(st.lists(st.one_of(number, st.just(np.nan)), min_size=3, max_size=3), min_size=1))
def test_nanmedian_is_numpys(rows: list[list[float]]) -> None:
    values = np.array(rows)
    for column in range(3):
        kept = values[np.isfinite(values[:, column]), column]
        expected = np.median(kept) if len(kept) else np.nan
        assert nanmedian(values)[column] == pytest.approx(expected, nan_ok=True)


def test_too_few_samples_give_no_slope() -> None:
    t = np.linspace(0.0, 1.0, 6)
    v = np.array([0.0, np.nan, 1.0, np.nan, np.nan, 2.0])
    assert np.isnan(theil_sen(t, v[:, None])[0][0])


@some
@given(st.integers(1, 70), st.integers(2, 20))
def test_bins_keep_means_and_all_samples(n: int, bins: int) -> None:
    t = np.arange(n, dtype=float)
    times, values = binned(t, (3.0 * t)[:, None], bins)
    assert len(times) <= max(bins, 1) or n <= bins
    assert np.allclose(values[:, 0], 3.0 * times)
    assert times[-1] <= t[-1]
    assert times[0] >= t[0]


@some
@given(number, number)
def test_velocity_of_a_rigid_body_is_found_from_any_half_of_its_outline(
    vx: float, vy: float
) -> None:
    """Half of the directions belong to the border and stand still: they have no say."""
    t = np.linspace(0.0, 1.0, 20)
    still = np.random.default_rng(1).uniform(10, 60, 16)
    reach = still + t[:, None] * (DIRECTIONS @ np.array([vx, vy]))
    free = np.ones(16, dtype=bool)
    free[:7] = False
    reach[:, :7] = still[:7]
    found = velocity(t, reach[:, None], np.broadcast_to(free, (20, 1, 16)))
    assert found[0] == pytest.approx([vx, vy], abs=1e-3)


def test_a_body_that_is_all_border_has_no_velocity() -> None:
    t = np.linspace(0.0, 1.0, 20)
    found = velocity(t, np.ones((20, 1, 16)), np.zeros((20, 1, 16), dtype=bool))
    assert np.isnan(found).all()


@some
@given(st.integers(0, 2**32 - 1), st.integers(0, 20), st.booleans())
def test_spans_in_one_pass_are_as_each_by_itself(seed: int, missing: int, whole: bool) -> None:
    rng = np.random.default_rng(seed)
    times, support = np.arange(20) / 25, rng.normal(size=(20, 3, 16))
    free = np.ones(support.shape, dtype=bool)
    if not whole:
        support[rng.integers(20, size=missing), rng.integers(3, size=missing)] = np.nan
        free = rng.random(support.shape) < 0.9
    spans = (slice(None), slice(None, 10), slice(10, None))
    slopes, usable = slopes_of_spans(times, support, free, spans)
    for k, p in enumerate(spans):
        alone = slopes_of_spans(times[p], support[p], free[p], (slice(None),))
        assert np.array_equal(usable[3 * k : 3 * k + 3], alone[1])
        one, other = slopes[3 * k : 3 * k + 3], alone[0]
        assert np.allclose(one[alone[1]], other[alone[1]], atol=1e-9)

"""Robust fits: exact on lines, deaf to outliers, right about the border; and as dumb twins say."""

import warnings

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from visup.rules.geometry._covered_motion_jit import COVERED_SIGMAS, uncovered_motion
from visup.rules.geometry._fit_jit import (
    binned,
    binned_trends,
    common_motion,
    median,
    slope_noise,
    velocities,
)
from visup.rules.geometry.regions import DIRECTIONS

Floats = NDArray[np.float64]

some = settings(max_examples=50, deadline=None)
number = st.floats(-100, 100)
UNSEEN = (np.nan, np.nan, np.nan)
seeds = st.integers(0, 2**32 - 1)


def theil_sen(times: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Lines through samples as they are, without bins."""
    return binned_trends(times, values, len(times))


def binned_of(times: Floats, values: Floats, bins: int) -> tuple[Floats, Floats]:
    """Bins as arrays of their own."""
    moments, means = np.empty(bins), np.empty(bins)
    count = binned(times, values, bins, moments, means)
    return moments[:count], means[:count]


def velocity(times: Floats, support: Floats, free: NDArray[np.bool_]) -> Floats:
    """Over all of the samples."""
    whole = np.array([[0, len(times)]])
    unseen = np.full((*support.shape[:2], 3), np.nan)
    limits = np.inf, 0.7, 3.0
    found: Floats = velocities(times, (support, np.array(free), unseen), whole, DIRECTIONS, limits)[
        0
    ]
    return found


def by_medians(times: Floats, values: Floats) -> tuple[float, float]:
    """`theil_sen` by NumPy's medians, pair by pair."""
    known = np.isfinite(values)
    t, v = times[known], values[known]
    if len(t) < 4:
        return np.nan, np.nan
    i, j = np.triu_indices(len(t), 1)
    slope = np.median((v[j] - v[i]) / (t[j] - t[i]))
    rest = v - slope * t
    spread = 1.4826 * np.median(np.abs(rest - np.median(rest))) * np.sqrt(len(t) / (len(t) - 2))
    return float(slope), float(np.sqrt(np.pi / 2) * spread / np.sqrt(((t - t.mean()) ** 2).sum()))


def by_bins(times: Floats, values: Floats, bins: int) -> tuple[Floats, Floats]:
    """`binned` by lists."""
    size = max(1, -(-len(times) // bins))
    ends = list(range(len(times), 0, -size))[::-1]
    parts = [slice(max(0, end - size), end) for end in ends]
    with np.errstate(invalid="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        means = [np.nanmean(values[p]) for p in parts]
    return np.array([times[p].mean() for p in parts]), np.array(means)


def series(seed: int, longest: int = 70) -> tuple[Floats, Floats]:
    """Times and values, some of them missing."""
    rng = np.random.default_rng(seed)
    count = int(rng.integers(1, longest))
    times = 3.0 + np.cumsum(rng.uniform(0.02, 0.06, count))
    values = rng.normal(0.0, 3.0, count) + rng.normal(0.0, 20.0) * times
    values[rng.random(count) < rng.choice([0.0, 0.3, 0.9])] = np.nan
    return times, values


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
@given(st.lists(number))
def test_the_median_is_numpys(values: list[float]) -> None:
    expected = np.median(values) if values else np.nan
    found = median(np.array(values, dtype=float), len(values))
    assert found == pytest.approx(expected, nan_ok=True)


@some
@given(seeds, st.integers(2, 20))
def test_lines_and_bins_are_those_of_dumb_twins(seed: int, bins: int) -> None:
    times, values = series(seed)
    alone = [x[0] for x in theil_sen(times, values[:, None])]
    assert alone == pytest.approx(by_medians(times, values), nan_ok=True)
    found, expected = binned_of(times, values, bins), by_bins(times, values, bins)
    assert np.allclose(found, expected, equal_nan=True)
    one = [x[0] for x in binned_trends(times, values[:, None], bins)]
    assert one == pytest.approx(by_medians(*expected), nan_ok=True)


def test_too_few_samples_give_no_slope() -> None:
    t = np.linspace(0.0, 1.0, 6)
    v = np.array([0.0, np.nan, 1.0, np.nan, np.nan, 2.0])
    assert np.isnan(theil_sen(t, v[:, None])[0][0])


@some
@given(st.integers(1, 70), st.integers(2, 20))
def test_bins_keep_means_and_all_samples(n: int, bins: int) -> None:
    t = np.arange(n, dtype=float)
    times, values = binned_of(t, 3.0 * t, bins)
    assert len(times) <= max(bins, 1) or n <= bins
    assert np.allclose(values, 3.0 * times)
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


def by_least_squares(slopes: Floats, misfit: float) -> Floats:
    """`common_motion` of slopes, NaN where not usable, by a library's solver."""
    known = np.isfinite(slopes)
    n, v, weight = DIRECTIONS[known], slopes[known], np.ones(known.sum())
    if len(v) < 3:
        return np.full(2, np.nan)
    for _ in range(5):
        root = np.sqrt(weight)[:, None]
        found = np.linalg.lstsq(root * n, root[:, 0] * v, rcond=None)[0]
        off = np.abs(v - n @ found)
        weight = 1.0 / np.maximum(off, 0.3)
    as_one = off.mean() <= max(misfit, np.hypot(*found) / 3)
    return np.asarray(found, float) if as_one else np.full(2, np.nan)


@some
@given(seeds, st.integers(0, 20), st.floats(0.5, 30.0))
def test_velocities_over_spans_are_those_of_a_dumb_twin(
    seed: int, missing: int, misfit: float
) -> None:
    rng = np.random.default_rng(seed)
    times = np.arange(20) / 25
    moves = times[:, None, None] * (rng.normal(0.0, 20.0, (3, 2)) @ DIRECTIONS.T)
    support = moves + rng.normal(0.0, rng.choice([0.1, 3.0]), (20, 3, 16))
    support[rng.integers(20, size=missing), rng.integers(3, size=missing)] = np.nan
    free = rng.random(support.shape) < rng.choice([1.0, 0.9, 0.4])
    spans = np.array([[0, 20], [0, 10], [10, 20], [17, 20]])
    image = np.full((20, 3, 3), np.nan)
    found = velocities(times, (support, free, image), spans, DIRECTIONS, (misfit, 0.5, 3.0))
    for s, (begin, end) in enumerate(spans):
        for i in range(3):
            slopes = np.full(16, np.nan)
            for k in range(16):
                good = free[begin:end, i, k] & np.isfinite(support[begin:end, i, k])
                if good.sum() >= max(4, 0.5 * (end - begin)):
                    t = times[begin:end][good]
                    slopes[k] = np.polyfit(t, support[begin:end, i, k][good], 1)[0]
            expected = by_least_squares(slopes, misfit)
            usable, known = np.isfinite(slopes), np.nan_to_num(slopes)
            alone = common_motion(known, usable, DIRECTIONS, misfit)
            assert alone == pytest.approx(tuple(expected), nan_ok=True, abs=1e-5)
            near = max(3.0, COVERED_SIGMAS * slope_noise(times[begin:end], 0.5))
            own = uncovered_motion(known, usable, DIRECTIONS, (alone, UNSEEN), near)
            assert found[s, i] == pytest.approx(own, nan_ok=True, abs=1e-5)

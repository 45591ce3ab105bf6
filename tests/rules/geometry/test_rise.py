"""Laws of the sequential test of a sudden rise."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from visup.rules.geometry.rise import RiseLimits, sudden_rise

TIMES = np.arange(0.0, 1.5, 1 / 15)
LIMITS = RiseLimits(noise=0.7, height=4.0, rate=0.0)
seeds = st.integers(0, 10_000)


def noise(seed: int, sigma: float = 0.5) -> np.ndarray:
    return np.random.default_rng(seed).normal(0.0, sigma, len(TIMES))


def rising(since: int, rate: float) -> np.ndarray:
    values: np.ndarray = rate * np.maximum(0.0, TIMES - TIMES[-1 - since])
    return values


@given(seeds, st.integers(2, 5), st.floats(80.0, 300.0))
def test_a_fast_rise_is_found_within_two_samples(seed: int, since: int, rate: float) -> None:
    found = sudden_rise(TIMES, rising(since, rate) + noise(seed), LIMITS)
    assert found == pytest.approx(TIMES[-1 - since], abs=0.07)


@given(seeds, st.floats(-30.0, 30.0))
def test_noise_and_steady_motion_are_no_rise(seed: int, slope: float) -> None:
    assert sudden_rise(TIMES, slope * TIMES + noise(seed), LIMITS) is None


@given(seeds, st.floats(5.0, 500.0))
def test_a_single_sample_is_no_rise_however_far_off(seed: int, jump: float) -> None:
    values = noise(seed)
    values[-1] += jump
    assert sudden_rise(TIMES, values, LIMITS) is None


@given(st.integers(4, 12), st.floats(5.0, 100.0))
def test_a_level_that_was_left_at_once_and_then_kept_is_none(since: int, jump: float) -> None:
    values = np.where(TIMES[-1 - since] < TIMES, jump, 0.0)
    assert sudden_rise(TIMES, values, LIMITS) is None


@given(seeds, st.floats(-200.0, -20.0))
def test_what_falls_or_stops_falling_does_not_rise(seed: int, rate: float) -> None:
    assert sudden_rise(TIMES, rising(4, rate) + noise(seed), LIMITS) is None
    stopped = rate * np.minimum(TIMES, TIMES[-5]) + noise(seed, 0.2)
    assert sudden_rise(TIMES, stopped, LIMITS) is None


@given(st.integers(2, 6), st.floats(80.0, 300.0), st.floats(0.1, 10.0), st.floats(-50.0, 50.0))
def test_neither_unit_nor_clock_nor_zero_matters(
    since: int, rate: float, unit: float, shift: float
) -> None:
    values = rising(since, rate) + noise(since)
    limits = RiseLimits(LIMITS.noise * unit, LIMITS.height * unit, 0.0)
    found = sudden_rise(TIMES, values, LIMITS)
    assert found is not None
    shifted = sudden_rise(TIMES + shift, unit * (values + shift), limits)
    assert shifted == pytest.approx(found + shift)


def test_samples_of_a_fast_camera_share_their_noise() -> None:
    fast = np.arange(0.0, 1.5, 1 / 60)
    values = 150.0 * np.maximum(0.0, fast - fast[-4])  # for 0.05 s
    assert sudden_rise(fast, values, LIMITS) is None
    assert sudden_rise(TIMES, rising(3, 150.0), LIMITS) is not None


def test_what_is_too_slow_too_low_or_too_short_is_none() -> None:
    values = rising(4, 60.0)
    assert sudden_rise(TIMES, values, LIMITS) is not None
    assert sudden_rise(TIMES, values, LIMITS._replace(height=20.0)) is None
    assert sudden_rise(TIMES, values, LIMITS._replace(rate=80.0)) is None
    assert sudden_rise(TIMES[-7:], values[-7:], LIMITS) is None
    assert sudden_rise(TIMES[:1], values[:1], LIMITS) is None
    assert sudden_rise(TIMES[:0], values[:0], LIMITS) is None

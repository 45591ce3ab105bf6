"""When a trend set in: laws of the bend that is fitted to noisy distances."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from visup.rules.geometry.bend import bend
from visup.rules.relations.samples import SampleWindow
from visup.rules.relations.trend import trend_onset

TIMES = np.arange(0.0, 1.5, 1 / 15)
knots = st.integers(3, len(TIMES) - 5)


def bent(at: float, before: float, after: float) -> np.ndarray:
    return 40.0 + before * (TIMES - at) + (after - before) * np.maximum(0.0, TIMES - at)


@given(knots, st.floats(-20.0, 5.0), st.floats(20.0, 200.0))
def test_a_bend_without_noise_is_found(k: int, before: float, after: float) -> None:
    assert bend(TIMES, bent(TIMES[k], before, after)) == pytest.approx(TIMES[k])


@given(knots, st.integers(0, 10_000))
def test_a_bend_is_found_in_noise(k: int, seed: int) -> None:
    noise = np.random.default_rng(seed).normal(0.0, 0.7, len(TIMES))
    found = bend(TIMES, bent(TIMES[k], 0.0, 60.0) + noise)
    assert found == pytest.approx(TIMES[k], abs=0.21)


@given(st.floats(0.1, 10.0), st.floats(0.0, 100.0), st.integers(0, 100))
def test_neither_unit_nor_clock_matters(scale: float, later: float, seed: int) -> None:
    noise = np.random.default_rng(seed).normal(0.0, 0.3, len(TIMES))
    values = bent(TIMES[9], 0.0, 50.0) + noise
    shifted = bend(TIMES + later, scale * values)
    found = bend(TIMES, values)
    assert found is not None
    assert shifted == pytest.approx(found + later)


@pytest.mark.parametrize("slope", [-30.0, 0.0, 30.0])
def test_a_straight_line_has_no_bend(slope: float) -> None:
    noise = np.random.default_rng(3).normal(0.0, 0.3, len(TIMES))
    assert bend(TIMES, slope * TIMES + noise) is None


def test_what_slows_down_or_turns_back_does_not_set_in() -> None:
    assert bend(TIMES, bent(0.8, 0.0, -50.0)) is None
    assert bend(TIMES, bent(0.8, -50.0, -10.0)) is None


def window(distance: np.ndarray) -> SampleWindow:
    apart = np.full((len(TIMES), 2, 2), np.nan)
    apart[:, 0, 1] = apart[:, 1, 0] = distance
    return SampleWindow(ids=(4, 7), times=TIMES, separation=apart)


@pytest.mark.parametrize(("trend", "sign"), [("diverging", 1.0), ("converging", -1.0)])
def test_a_trend_is_told_from_its_contrary(trend: str, sign: float) -> None:
    found = trend_onset(window(sign * bent(TIMES[10], 0.0, 60.0)), 7, 4, trend)
    assert found == pytest.approx(TIMES[10])
    assert trend_onset(window(-sign * bent(TIMES[10], 0.0, 60.0)), 7, 4, trend) is None


def test_what_was_not_seen_is_left_out_and_too_little_tells_nothing() -> None:
    values = bent(TIMES[10], 0.0, 60.0)
    values[[2, 5, 15]] = np.nan
    assert trend_onset(window(values), 4, 7, "diverging") == pytest.approx(TIMES[10])
    values[5:] = np.nan
    assert trend_onset(window(values), 4, 7, "diverging") is None
    assert trend_onset(window(values), 4, 9, "diverging") is None

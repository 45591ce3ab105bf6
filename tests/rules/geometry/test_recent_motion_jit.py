"""What moves is told as it moves now: by the longest window that agrees with all shorter ones."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from visup.rules.geometry._fit_jit import slope_noise
from visup.rules.geometry._recent_motion_jit import (
    fit_motion,
    jitter,
    longest_that_agrees,
    steady_trend,
)
from visup.rules.geometry.regions import DIRECTIONS

Floats = NDArray[np.float64]
some = settings(max_examples=50, deadline=None)
seeds = st.integers(0, 2**32 - 1)
LIMITS = (1.5, 1.25, 0.5, 3.0, 4.0, 6.0)


def windows(times: Floats, longest: float) -> NDArray[np.int64]:
    begins = times[-1] - longest * np.array([0.25, 0.5, 1.0]) - 1e-6
    return np.asarray(np.searchsorted(times, begins), dtype=np.int64)


def trend(times: Floats, values: Floats, noise: float = 0.7) -> tuple[float, float]:
    room = np.empty((18, 16))
    return steady_trend(times, values, windows(times, 1.5), (noise, 4.0, 3.0), room)


@some
@given(seeds, st.integers(1, 4), st.integers(1, 2), st.floats(0.5, 8.0), st.floats(0.0, 20.0))
def test_the_window_is_the_longest_that_no_shorter_one_contradicts(
    seed: int, count: int, parts: int, far: float, least: float
) -> None:
    rng = np.random.default_rng(seed)
    found, sigmas = rng.normal(0.0, 10.0, (count, parts)), rng.uniform(0.1, 5.0, count)
    found[rng.random(count) < 0.2] = np.nan

    def apart(w: int, u: int) -> bool:
        off = float(np.linalg.norm(found[w] - found[u]))
        return off > max(least, far * float(np.hypot(sigmas[w], sigmas[u])))

    known = [w for w in range(count) if not np.isnan(found[w, 0])]
    agree = [w for w in known if not any(apart(w, u) for u in known if u < w)]
    first_break = next((w for w in known if w not in agree), count)
    expected = max((w for w in known if w < first_break), default=0)
    assert longest_that_agrees(found, sigmas, (far, least)) == expected


@pytest.mark.parametrize(
    ("before", "after"), [(-40.0, 0.0), (0.0, 40.0), (10.0, 60.0), (30.0, -30.0), (5.0, 5.0)]
)
@pytest.mark.parametrize("ago", [0.45, 0.8])
def test_what_changed_a_moment_ago_is_told_as_it_is_now(
    before: float, after: float, ago: float
) -> None:
    times = np.arange(0.0, 1.5, 1 / 15)
    values = np.where(times < 1.5 - ago, before, after) * (times - (1.5 - ago))
    assert trend(times, values)[0] == pytest.approx(after, abs=3.0)


@some
@given(seeds, st.floats(-20.0, 20.0))
def test_a_line_is_known_as_well_as_its_whole_window_tells(seed: int, slope: float) -> None:
    """Noise that was allowed for makes nobody look at less than there is, but in a few of a hundred."""
    rng, times = np.random.default_rng(seed), np.arange(0.0, 1.5, 1 / 25)
    found, sigma = trend(times, slope * times + rng.normal(0.0, 0.7, len(times)))
    assert abs(found - slope) <= 6.0 * sigma
    assert sigma <= 6.0 * slope_noise(times, 0.7) or sigma <= slope_noise(times[-9:], 0.7) * 6.0


@some
@given(seeds, st.floats(0.1, 5.0), st.floats(-50.0, 50.0))
def test_noise_is_told_apart_from_motion(seed: int, noise: float, slope: float) -> None:
    rng, times = np.random.default_rng(seed), np.arange(60) / 25
    values = slope * times + rng.normal(0.0, noise, 60)
    assert jitter(values) == pytest.approx(noise, rel=0.45)
    assert np.isnan(jitter(values[:2]))


def test_a_body_that_stops_is_told_to_rest_though_it_moved_fast() -> None:
    times = np.arange(0.0, 1.5, 1 / 25)
    path = 100.0 * np.minimum(times, 1.0)
    support = (20.0 + path[:, None] * DIRECTIONS[:, 0])[:, None]
    free, separation = np.ones(support.shape, dtype=bool), np.zeros((len(times), 1, 1))
    image = np.full((len(times), 1, 3), np.nan)
    _, _, motion, sigma = fit_motion(
        times, (support, free, image), separation, DIRECTIONS, LIMITS, 16
    )
    assert np.hypot(*motion[0, 0]) < 3.0 + 4.0 * sigma[0]
    assert np.hypot(*motion[1, 0]) == pytest.approx(100.0, rel=0.01)  # as it did in the first half


def test_nothing_is_fitted_before_there_is_enough() -> None:
    times = np.arange(5) / 25
    blank = np.zeros((5, 2, 16))
    slope, sigma, motion, spread = fit_motion(
        times,
        (blank, blank == 0, blank[..., :3].copy()),
        np.zeros((5, 2, 2)),
        DIRECTIONS,
        LIMITS,
        16,
    )
    assert np.isnan(slope).all()
    assert np.isnan(sigma).all()
    assert np.isnan(motion).all()
    assert np.isnan(spread).all()

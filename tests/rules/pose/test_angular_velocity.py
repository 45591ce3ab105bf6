"""Rates of turn from orientations: exact ones, noisy ones, twins, changes, and stillness."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from visup.rules.pose.angular_velocity import (
    AngularVelocity,
    SpinSettings,
    estimate_angular_velocity,
    spin_of,
)
from visup.rules.pose.angular_velocity_fit import OrientationSeries

S = SpinSettings()


def turning(
    rate: float, seconds: float, seed: int, noise_deg: float = 0.0, every: float = 0.15
) -> tuple[OrientationSeries, np.ndarray]:
    """An object that turns evenly about a random axis, and its rotation vector per second."""
    rng = np.random.default_rng(seed)
    axis = rng.normal(size=3)
    axis /= np.linalg.norm(axis)
    times = np.arange(0.0, seconds, every)
    turns = Rotation.from_rotvec(np.radians(rate) * times[:, None] * axis)
    noise = Rotation.from_rotvec(np.radians(noise_deg) * rng.normal(size=(len(times), 3)))
    seen = noise * turns * Rotation.random(random_state=seed)
    return OrientationSeries(times, seen.as_matrix()), np.radians(rate) * axis


def measure(
    turns: OrientationSeries, before: AngularVelocity | None = None
) -> AngularVelocity | None:
    return estimate_angular_velocity(turns, float(turns.times[-1]), before, S)


@given(st.floats(0.0, 90.0), st.floats(3.0, 30.0), st.integers(0, 1000))
@settings(deadline=None, max_examples=40)
def test_an_even_turn_is_measured_exactly(rate: float, seconds: float, seed: int) -> None:
    turns, true = turning(rate, seconds, seed)
    found = measure(turns)
    assert found is not None
    assert np.degrees(np.linalg.norm(found.vector - true)) < 0.05


@pytest.mark.parametrize("rate", [2.0, 8.0, 30.0, 60.0])
def test_noise_and_outliers_do_no_harm(rate: float) -> None:
    for seed in range(4):
        turns, true = turning(rate, 15.0, seed, noise_deg=6.0)
        rng = np.random.default_rng(seed)
        wrong = rng.random(len(turns.times)) < 0.15
        anywhere = Rotation.random(len(wrong), random_state=seed).as_matrix()
        seen = np.where(wrong[:, None, None], anywhere, turns.orientations)
        found = measure(OrientationSeries(turns.times, seen))
        assert found is not None
        assert np.degrees(np.linalg.norm(found.vector - true)) < 0.15 * rate + 0.3


def test_the_twin_of_a_symmetric_object_turns_alike() -> None:
    turns, true = turning(5.0, 16.0, 3, noise_deg=3.0)
    half_turn = Rotation.from_rotvec([0, 0, np.pi]).as_matrix()
    later = turns.times[:, None, None] > 8.0
    found = measure(
        OrientationSeries(
            turns.times, np.where(later, turns.orientations @ half_turn, turns.orientations)
        )
    )
    assert found is not None
    assert np.degrees(np.linalg.norm(found.vector - true)) < 0.5


def test_a_still_object_has_a_rate_near_zero_with_a_sigma() -> None:
    for seed in range(6):
        turns, _ = turning(0.0, 20.0, seed, noise_deg=6.0)
        rate = measure(turns)
        assert rate is not None
        spin = spin_of(rate, S)
        assert spin is not None
        assert spin.rate < 0.6
        assert 0.05 < spin.sigma < 0.6


def test_a_view_that_never_changes_still_leaves_room_for_a_slow_turn() -> None:
    times = np.arange(0.0, 10.0, 0.2)
    rate = measure(OrientationSeries(times, np.broadcast_to(np.eye(3), (len(times), 3, 3))))
    assert rate is not None
    spin = spin_of(rate, S)
    assert spin is not None
    assert spin.rate == pytest.approx(0.0, abs=1e-6)
    assert spin.sigma * 10.0 > 2.0


@pytest.mark.parametrize(("first", "second"), [(1.0, 5.0), (20.0, 4.0), (0.0, 10.0), (3.0, 0.0)])
def test_a_change_of_rate_is_followed_within_six_seconds(first: float, second: float) -> None:
    before, _ = turning(first, 12.0, 1)
    after, true = turning(second, 12.0, 2)
    link = after.orientations[0].T @ before.orientations[-1]
    rng = np.random.default_rng(4)
    seen = np.concatenate([before.orientations, (after.orientations @ link)[1:]])
    shaken = Rotation.from_rotvec(np.radians(4.0) * rng.normal(size=(len(seen), 3))).as_matrix()
    times = np.concatenate([before.times, before.times[-1] + after.times[1:]])
    every = OrientationSeries(times, shaken @ seen)
    rate, found = None, {}
    for now in np.arange(3.0, times[-1], 1.0):
        until = times <= now
        rate = estimate_angular_velocity(
            OrientationSeries(times[until], every.orientations[until]), now, rate, S
        )
        found[float(now)] = rate
    hit = before.times[-1]
    for now, told in found.items():
        if now < hit or told is None:
            continue
        error = np.degrees(np.linalg.norm(told.vector - true))
        if now > hit + 6.0:
            assert error < 0.2 * second + 1.0
    last = found[max(found)]
    assert last is not None
    assert last.since == pytest.approx(hit, abs=1.5)


def test_too_little_is_unknown() -> None:
    assert measure(turning(5.0, 0.9, 0)[0]) is None
    one = OrientationSeries(np.zeros(1), np.eye(3)[None])
    assert measure(one) is None
    # Orientations all over the place do not hang together.
    scattered = OrientationSeries(np.arange(12.0), Rotation.random(12, random_state=1).as_matrix())
    assert measure(scattered) is None


def test_what_is_too_uncertain_is_not_told() -> None:
    vague = AngularVelocity(np.array([0.1, 0.0, 0.0]), np.eye(3) * 0.1**2, 0.5, 0.0)
    assert spin_of(vague, S) is None
    sure = AngularVelocity(np.array([0.1, 0.0, 0.0]), np.eye(3) * 0.001**2, 0.5, 0.0)
    spin = spin_of(sure, S)
    assert spin is not None
    assert spin.axis == pytest.approx((1.0, 0.0, 0.0))
    assert spin.rate == pytest.approx(np.degrees(0.1), rel=0.01)


def test_a_change_is_found_however_long_ago_it_was() -> None:
    """What only the rate after it tells: a slow turn that became a faster one."""
    for ago in (9.0, 13.0, 18.0):
        before, _ = turning(0.6, 14.0, 3)
        after, true = turning(3.0, ago, 5)
        link = after.orientations[0].T @ before.orientations[-1]
        seen = np.concatenate([before.orientations, (after.orientations @ link)[1:]])
        noise = 3.0 * np.random.default_rng(6).normal(size=(len(seen), 3))
        times = np.concatenate([before.times, before.times[-1] + after.times[1:]])
        shaken = Rotation.from_rotvec(np.radians(noise)).as_matrix() @ seen
        found = measure(OrientationSeries(times, shaken))
        assert found is not None
        assert found.since == pytest.approx(before.times[-1], abs=2.0)
        assert np.degrees(np.linalg.norm(found.vector - true)) < 0.2 * 3.0

"""How two bodies move relative to each other, and what that tells of rest."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from scipy.stats import multivariate_normal

from tests.rules.scenes import SIZE, box_region
from visup.agent import CameraMotion, Region
from visup.agent.model.fast_replace import replace
from visup.rules.coupling.relative_motion import (
    OutlineTemplate,
    RelativeTrack,
    RelativeVelocity,
    begin_relative_track,
    outline_template,
    register_outline,
    relative_velocity,
    target_of,
    update_relative_track,
)
from visup.rules.geometry._outlines_jit import icp_step

STILL, MOVING = 2.0, 10.0
speeds = st.floats(-40.0, 40.0)


def at_speed(x: float, y: float, variance: float) -> RelativeVelocity:
    return RelativeVelocity(np.array([x, y]), variance * np.eye(2), 0.3)


def track(path: list[tuple[float, ...]]) -> RelativeTrack:
    nothing = OutlineTemplate(np.zeros((0, 2)), np.zeros((0, 2)))
    return RelativeTrack(nothing, nothing, 0.0, path=tuple(path))


def places(speed: float, until: float = 1.0, missing: range = range(0)) -> list[tuple[float, ...]]:
    """A relative path at 25 places a second, shaken by half a pixel; no image motion is known."""
    shake = 0.5 * np.random.default_rng(1).normal(size=(round(25 * until), 2))
    every = [(k / 25, speed * k / 25 + x, y, *[np.nan] * 3) for k, (x, y) in enumerate(shake)]
    return [p for k, p in enumerate(every) if k not in missing]


@given(speeds, speeds, st.floats(0.01, 100.0))
def test_whichever_way_a_body_moves_it_tells_the_same(x: float, y: float, variance: float) -> None:
    odds = at_speed(x, y, variance).rest_odds(STILL, MOVING)
    for other in ((-x, y), (x, -y), (y, x)):
        assert at_speed(*other, variance).rest_odds(STILL, MOVING) == pytest.approx(odds, abs=1e-6)


@given(speeds, st.floats(1.01, 3.0), st.floats(0.01, 100.0))
def test_the_faster_it_moves_the_less_it_rests(speed: float, more: float, variance: float) -> None:
    slow = at_speed(speed, 0.0, variance).rest_odds(STILL, MOVING)
    fast = at_speed(speed * more, 0.0, variance).rest_odds(STILL, MOVING)
    assert fast <= slow + 1e-9


@given(speeds, speeds, st.floats(0.01, 50.0), st.floats(0.01, 50.0), st.floats(-0.9, 0.9))
def test_odds_are_those_of_two_normal_distributions(
    x: float, y: float, xx: float, yy: float, together: float
) -> None:
    xy = together * np.sqrt(xx * yy)
    covariance = np.array([[xx, xy], [xy, yy]])
    told = RelativeVelocity(np.array([x, y]), covariance, 0.3).rest_odds(STILL, MOVING)
    rest, free = (
        multivariate_normal(cov=covariance + variance * np.eye(2)).logpdf([x, y])
        for variance in (0.5 * STILL**2, MOVING**2)
    )
    assert told == pytest.approx(rest - free, rel=1e-9, abs=1e-9)


@given(st.integers(0, 2**32 - 1), st.floats(0.0, 4.0))
def test_a_step_onto_an_outline_is_that_of_weighted_least_squares(seed: int, wide: float) -> None:
    rng = np.random.default_rng(seed)
    angle = rng.uniform(0.0, wide, 30)
    normals = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    off = rng.normal(0.0, 2.0, (30, 2))
    across = (off * normals).sum(axis=1)
    weight = 1.0 / np.maximum(np.abs(across), 1.5)
    square = (normals * weight[:, None]).T @ normals
    known, *found = icp_step(normals, off, len(off), 1.5)
    if not known:
        assert np.linalg.cond(square) > 49.0
    else:
        assert np.linalg.cond(square) < 51.0
        expected = np.linalg.solve(square, normals.T @ (weight * across))
        assert np.allclose(found, expected, atol=1e-9)


@given(st.floats(0.01, 1e4))
def test_what_is_hardly_known_tells_little(variance: float) -> None:
    known = at_speed(0.0, 0.0, variance).rest_odds(STILL, MOVING)
    less = at_speed(0.0, 0.0, 2 * variance).rest_odds(STILL, MOVING)
    assert 0.0 < less < known
    assert at_speed(0.0, 0.0, 1e9).rest_odds(STILL, MOVING) == pytest.approx(0.0, abs=1e-6)


def test_rest_and_motion_are_told_apart() -> None:
    assert at_speed(0.5, 0.5, 1.0).rest_odds(STILL, MOVING) > 2.0
    assert at_speed(6.0, 0.0, 1.0).rest_odds(STILL, MOVING) < 0.0


@pytest.mark.parametrize("speed", [0.0, 8.0, 25.0])
def test_the_slope_of_a_path_is_its_speed(speed: float) -> None:
    found = relative_velocity(track(places(speed)), 0.96, 0.3)
    assert found is not None
    assert abs(found.velocity[0] - speed) < 3 * np.sqrt(found.covariance[0, 0])
    assert found.span == pytest.approx(0.28, abs=0.05)


def test_after_a_gap_the_way_gone_in_it_tells() -> None:
    found = relative_velocity(track(places(8.0, missing=range(8, 22))), 0.96, 0.3)
    assert found is not None
    assert found.span > 0.6
    assert found.velocity[0] == pytest.approx(8.0, abs=2.0)


@given(st.sets(st.integers(0, 24)))
@example(set(range(5, 20)))
def test_whatever_is_missing_motion_stays_known(missing: set[int]) -> None:
    path = [p for k, p in enumerate(places(0.0)) if k not in missing]
    known = len(path) > 5 and path[-1][0] - path[0][0] >= 0.6 * 0.3
    found = relative_velocity(track(path), path[-1][0], 0.3) if path else None
    assert (found is not None) == known
    assert found is None or found.span >= 0.6 * 0.3 - 1e-6


def by_arrays(path: np.ndarray, now: float, window: float) -> RelativeVelocity:
    """`relative_velocity` by matrices."""
    velocity = (path[-1, 1:3] - path[0, 1:3]) / (path[-1, 0] - path[0, 0])
    steps = np.diff(path[:, 1:3], axis=0) - np.diff(path[:, :1], axis=0) * velocity
    noise = steps.T @ steps / len(steps) + 1e-4 * np.eye(2)
    inside = int((path[:, 0] > now - window - 1e-6).sum())
    long = int((path[:, 0] > path[-1, 0] - 0.6 * window + 1e-6).sum()) + 1
    recent = path[-max(inside, long, 5) :]
    span = float(recent[-1, 0] - recent[0, 0])
    t = recent[:, 0] - recent[:, 0].mean()
    slope, spread = t @ recent[:, 1:3] / (t @ t), noise / (t @ t)
    flow = recent[np.isfinite(recent[:, 5]), 3:]
    if not len(flow):
        return RelativeVelocity(slope, spread, span)
    certain = max(1.0, span / 0.2) / flow[:, 2].mean() * np.eye(2)
    both = np.linalg.inv(np.linalg.inv(spread) + certain)
    mean = np.linalg.solve(spread, slope) + certain @ flow[:, :2].mean(axis=0)
    return RelativeVelocity(both @ mean, both, span)


@given(st.integers(0, 2**32 - 1), st.booleans(), st.sampled_from([0.0, 0.1, 1.0]))
def test_motion_is_that_of_matrices(seed: int, told: bool, later: float) -> None:
    rng = np.random.default_rng(seed)
    count = int(rng.integers(6, 30))
    path = np.full((count, 6), np.nan)
    path[:, 0] = np.cumsum(rng.choice([0.04, 0.08, 0.12], count))
    path[:, 1:3] = np.cumsum(rng.normal(0.0, 1.0, (count, 2)), axis=0)
    if told:
        path[:, 3:] = rng.uniform(0.1, 2.0, (count, 3))
        path[rng.random(count) < 0.3, 3:] = np.nan
    now = float(path[-1, 0]) + later
    found = relative_velocity(track([tuple(p) for p in path.tolist()]), now, 0.3)
    expected = by_arrays(path, now, 0.3)
    assert found is not None
    assert found.span == pytest.approx(expected.span)
    assert np.allclose(found.velocity, expected.velocity)
    assert np.allclose(found.covariance, expected.covariance)


@pytest.mark.parametrize("count", range(6))
def test_of_a_few_places_nothing_is_told(count: int) -> None:
    assert relative_velocity(track(places(8.0)[:count]), count / 25, 0.3) is None


@pytest.mark.parametrize(
    ("speed", "known"), [(20.0, False), (20.0, True), (200.0, False), (200.0, True), (700.0, True)]
)
def test_boxes_that_move_apart_are_followed(speed: float, known: bool) -> None:
    """700 pixels a second are 28 from frame to frame, more than closest points reach by themselves."""
    sigma = 1.0 if known else 0.0

    def both(t: float) -> tuple[Region, Region]:
        first = box_region(1, (10, 200, 80, 60))
        second = box_region(2, (94 + speed * t, 200, 80, 60))
        assert first is not None
        assert second is not None
        return replace(first, velocity_sigma=sigma), replace(
            second, velocity=(speed, 0.0), velocity_sigma=sigma
        )

    frames = 16
    followed = begin_relative_track(both(0.0), 0.0, SIZE)
    for k in range(1, frames):
        now = k / 25
        followed = update_relative_track(followed, both(now), now, SIZE, (1.2, 2.5))
    assert followed is not None
    assert followed.since == 0.0  # the outlines that were stored first are still found
    found = relative_velocity(followed, (frames - 1) / 25, 0.3)
    assert found is not None
    assert found.velocity[0] == pytest.approx(speed, rel=0.02, abs=1.0)
    assert found.rest_odds(STILL, MOVING) < -5.0


@pytest.mark.parametrize("known", [False, True])
@pytest.mark.parametrize("rate", [1.004, 0.996, 1.0])
def test_bodies_at_rest_before_a_zooming_camera_are_at_rest(rate: float, known: bool) -> None:
    """Zoomed by a tenth in a second, bodies 200 pixels apart move apart by 20 pixels a second."""
    camera = CameraMotion(np.array([[rate, 0.0, 0.0], [0.0, rate, 0.0]]))
    frames, found = 30, {}
    for given_camera in (camera, None):
        followed = begin_relative_track(two_boxes(1.0, 1.0, known), 0.0, SIZE)
        for k in range(1, frames):
            regions = two_boxes(rate**k, rate, known)
            followed = update_relative_track(
                followed, regions, k / 25, SIZE, (1.2, 0.5), given_camera
            )
        assert followed is not None
        velocity = relative_velocity(followed, (frames - 1) / 25, 0.3)
        assert velocity is not None
        found[given_camera is None] = velocity
    assert np.hypot(*found[False].velocity) < 3.0
    if rate != 1.0:
        assert np.hypot(*found[True].velocity) > 12.0


def two_boxes(zoom: float, rate: float, known: bool) -> tuple[Region, Region]:
    """Two boxes 200 pixels apart, in a picture magnified about its corner."""
    sigma, found = 1.0 if known else 0.0, []
    for number, x in enumerate((150.0, 350.0), 1):
        region = box_region(number, (x * zoom, 150 * zoom, 80 * zoom, 60 * zoom))
        assert region is not None
        speed = 25 * (rate - 1) * zoom * np.array([x + 40, 180])
        found.append(replace(region, velocity=tuple(speed.tolist()), velocity_sigma=sigma))
    return found[0], found[1]


@given(st.floats(-60, 60), st.floats(-60, 60))
def test_an_outline_is_found_where_it_is_expected(dx: float, dy: float) -> None:
    region, moved = box_region(1, (200, 200, 80, 60)), box_region(1, (200 + dx, 200 + dy, 80, 60))
    assert region is not None
    assert moved is not None
    kept = outline_template(region, (), SIZE)
    assert kept is not None
    found = register_outline(kept, target_of(moved), [(dx + 4.0, dy - 4.0)])
    assert found is not None
    assert found.shift == pytest.approx((round(dx), round(dy)), abs=1.0)

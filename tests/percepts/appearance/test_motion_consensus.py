"""What points agree on: exact points decide, those on an edge only across it."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from visup.percepts.appearance.background.camera_motion import BETTER
from visup.percepts.appearance.background.motion_consensus import (
    NOISE,
    PointPairs,
    covariance_at,
    likeliest_motion,
    rest_of,
)
from visup.percepts.appearance.background.point_tracking import STILL

Doubles = NDArray[np.float64]
CORNERS = np.array([(20.0, 20.0), (460.0, 20.0), (20.0, 340.0), (460.0, 340.0)])


def spread_points(rng: np.random.Generator, count: int) -> Doubles:
    """(count, 2): points all over a picture of 480 x 360."""
    return rng.uniform((10, 10), (470, 350), (count, 2))


def similarity(turn: float, zoom: float, shift: tuple[float, float]) -> Doubles:
    c, s = (1 + zoom) * np.cos(turn), (1 + zoom) * np.sin(turn)
    about = np.array([240.0, 180.0])
    linear = np.array([[c, -s], [s, c]])
    return np.column_stack([linear, about + shift - linear @ about])


def moved(points: Doubles, motion: Doubles) -> Doubles:
    return np.asarray(points @ motion[:, :2].T + motion[:, 2])


def off(a: Doubles, b: Doubles) -> float:
    """The greatest difference of two motions within the picture, pixels."""
    return float(np.hypot(*(moved(CORNERS, a) - moved(CORNERS, b)).T).max())


def alike(sigma: float, count: int) -> Doubles:
    return np.tile(np.eye(2) * sigma**2, (count, 1, 1))


@settings(max_examples=60, deadline=None)
@given(
    st.integers(0, 1000),
    st.floats(-0.02, 0.02),
    st.floats(-0.03, 0.03),
    st.tuples(st.floats(-12, 12), st.floats(-12, 12)),
)
def test_a_motion_is_found_whatever_a_third_of_the_points_does(
    seed: int, turn: float, zoom: float, shift: tuple[float, float]
) -> None:
    rng, true = np.random.default_rng(seed), similarity(turn, zoom, shift)
    key = spread_points(rng, 60)
    now = moved(key, true) + rng.normal(0, 0.1, key.shape)
    now[:20] += rng.uniform(-15, 15, (20, 2))
    found = likeliest_motion(PointPairs(key, now, alike(0.1, 60)), BETTER)
    # A shift of up to a pixel at the border may pass for rest, and a slight turn for a shift.
    assert off(found.motion, true) < 1.5


def test_points_at_rest_give_rest_itself() -> None:
    rng = np.random.default_rng(1)
    key = spread_points(rng, 40)
    pairs = PointPairs(key, key + rng.normal(0, 0.05, key.shape), alike(0.1, 40))
    assert likeliest_motion(pairs, BETTER).motion is STILL
    assert rest_of(pairs).support > 0.9 * pairs.total


def test_exact_points_outvote_twice_as_many_vague_ones() -> None:
    """Twelve corners rest; thirty points of a plain floor, off by pixels, happen to drift alike."""
    rng = np.random.default_rng(2)
    key = spread_points(rng, 42)
    now = key.copy()
    now[12:] += rng.normal((3.0, 1.0), 0.3, (30, 2))
    vague = np.concatenate([alike(0.1, 12), alike(6.0, 30)])
    assert likeliest_motion(PointPairs(key, now, vague), BETTER).motion is STILL
    exact = likeliest_motion(PointPairs(key, now, alike(0.3, 42)), BETTER)
    assert off(exact.motion, similarity(0.0, 0.0, (3.0, 1.0))) < 0.5


@pytest.mark.parametrize("angle", [0.0, 0.8, 1.6, 2.4])
def test_a_point_on_an_edge_counts_across_it(angle: float) -> None:
    """Parallel edges slide along themselves by any amount; two dozen of them, and corners for the rest."""
    rng = np.random.default_rng(3)
    true = similarity(0.0, 0.0, (4.0, -2.0))
    along, across = (np.cos(angle), np.sin(angle)), (-np.sin(angle), np.cos(angle))
    key = spread_points(rng, 32)
    now = moved(key, true)
    now[:24] += np.outer(rng.uniform(-8, 8, 24), along)
    edges = np.tile(
        8.0**2 * np.outer(along, along) + 0.05**2 * np.outer(across, across), (24, 1, 1)
    )
    pairs = PointPairs(key, now, np.concatenate([edges, alike(0.1, 8)]))
    found = likeliest_motion(pairs, BETTER)
    assert off(found.motion, true) < 0.3
    assert found.support > 0.8 * pairs.total


@pytest.mark.parametrize("seed", range(4))
def test_many_points_are_more_exact_than_each(seed: int) -> None:
    """To half a pixel at the border of the picture, from points that are off by one each."""
    rng, true = np.random.default_rng(seed), similarity(0.01, 0.01, (6.0, 2.0))
    key = spread_points(rng, 150)
    now = moved(key, true) + rng.normal(0, 1.0, key.shape)
    found = likeliest_motion(PointPairs(key, now, alike(1.0, 150)), BETTER)
    assert off(found.motion, true) < 0.5


def test_contrast_is_no_majority() -> None:
    """Fourteen points of great contrast rest, on a sign; two dozen good ones move."""
    key = spread_points(np.random.default_rng(8), 38)
    now = key.copy()
    now[14:] += (6.0, 2.0)
    pairs = PointPairs(key, now, np.concatenate([alike(0.01, 14), alike(0.9, 24)]))
    assert off(likeliest_motion(pairs, BETTER).motion, similarity(0.0, 0.0, (6.0, 2.0))) < 0.3


def test_a_camera_that_turns_fast_may_depart_from_a_similarity() -> None:
    """Where the picture shifts by 16 pixels in its middle, it shifts by more near its border."""
    key = spread_points(np.random.default_rng(4), 60)
    stretch = 1 + 0.06 * ((key[:, 0] - 240) / 240) ** 2
    now = key + np.column_stack([16 * stretch, np.zeros(60)])
    pairs = PointPairs(key, now, alike(0.05, 60))
    found = likeliest_motion(pairs, BETTER)
    assert found.support > 0.8 * pairs.total
    assert abs(moved(np.array([[240.0, 180.0]]), found.motion)[0, 0] - 256) < 0.5


def test_a_motion_must_be_better_supported_than_rest() -> None:
    """As many points rest as move: the camera rests."""
    key = spread_points(np.random.default_rng(6), 40)
    now = key.copy()
    now[:20] += (6.0, 0.0)
    pairs = PointPairs(key, now, alike(0.1, 40))
    assert likeliest_motion(pairs, BETTER).motion is STILL
    assert likeliest_motion(pairs, 0.5).motion is not STILL


def reference_covariance(grey: NDArray[np.uint8], x: int, y: int, window: int) -> Doubles:
    """By OpenCV, over the whole image."""
    dx, dy = (cv2.Scharr(grey, cv2.CV_32F, *axis) / 32.0 for axis in ((1, 0), (0, 1)))
    half = window // 2
    part = np.s_[y - half : y + half + 1, x - half : x + half + 1]
    rows = np.stack([dx[part].ravel(), dy[part].ravel()]).astype(float)
    return np.asarray(NOISE**2 * np.linalg.inv(rows @ rows.T))


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 100), st.integers(10, 50), st.integers(10, 40))
def test_the_covariance_is_that_of_the_structure_tensor(seed: int, x: int, y: int) -> None:
    noise = np.random.default_rng(seed).integers(0, 255, (50, 60), dtype=np.uint8)
    grey = np.asarray(cv2.GaussianBlur(noise, (5, 5), 1.5), dtype=np.uint8)
    (found,) = covariance_at(grey, np.array([[x, y]], dtype=np.float32), 13)
    assert found == pytest.approx(reference_covariance(grey, x, y, 13), rel=0.02)


def test_what_has_no_texture_is_as_good_as_unknown() -> None:
    plain = np.full((40, 40), 90, dtype=np.uint8)
    covariance = covariance_at(plain, np.array([[20, 20], [0, 0], [39, 39]], dtype=np.float32), 13)
    assert (np.linalg.eigvalsh(covariance) > 100.0**2).all()
    pairs = PointPairs(np.zeros((3, 2)), np.zeros((3, 2)), covariance)
    assert pairs.total == 0.0

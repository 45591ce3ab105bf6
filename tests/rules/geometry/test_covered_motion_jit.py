"""Bodies that are covered in part: whose edges move, and which of them are the body's own."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from visup.rules.geometry._covered_motion_jit import (
    AS_ONE,
    CLEARLY,
    IMAGE_COUNTS,
    SOME,
    UNEVEN,
    image_velocity,
    uncovered_motion,
)
from visup.rules.geometry._fit_jit import common_motion
from visup.rules.geometry.regions import DIRECTIONS

Floats = NDArray[np.float64]
Motion = tuple[float, float]
ALL = np.ones(16, dtype=bool)
UNSEEN = (np.nan, np.nan, np.nan)
NEAR = 3.0
some = settings(max_examples=100, deadline=None)
velocity = st.tuples(st.floats(-80.0, 80.0), st.floats(-80.0, 80.0))
seeds = st.integers(0, 2**32 - 1)


def covered(own: Motion, edge: Motion, first: int, count: int) -> Floats:
    """Slopes of an outline that moves, of which so many directions belong to an edge that covers it."""
    slopes: Floats = DIRECTIONS @ own
    hidden = np.arange(first, first + count) % 16
    slopes[hidden] = DIRECTIONS[hidden] @ edge
    return slopes


def told(slopes: Floats, image: tuple[float, float, float], near: float = NEAR) -> Motion:
    outline = common_motion(slopes, ALL, DIRECTIONS, 4.5)
    return uncovered_motion(slopes, ALL, DIRECTIONS, (outline, image), near)


@some
@given(velocity, velocity, st.integers(0, 15), st.integers(3, 9))
def test_with_image_motion_a_covered_body_moves_as_its_own_edges_do(
    own: Motion, edge: Motion, first: int, count: int
) -> None:
    """With more than half of its edges covered it may be unknown."""
    x, y = told(covered(own, edge, first, count), (*own, 0.3))
    if count > 8 and np.isnan(x):
        return
    assert np.hypot(x - own[0], y - own[1]) <= max(2 * NEAR, 2 * UNEVEN * np.hypot(*own)) + 1e-6


@some
@given(velocity, st.integers(0, 15), st.integers(4, 7))
def test_without_image_motion_a_covered_body_at_rest_does_not_move_with_what_covers_it(
    edge: Motion, first: int, count: int
) -> None:
    x, y = told(covered((0.0, 0.0), edge, first, count), UNSEEN)
    assert np.isnan(x) or np.hypot(x, y) <= 2 * NEAR


@some
@given(st.floats(-80.0, 80.0), st.integers(0, 15))
def test_half_and_half_is_unknown_without_image_motion(pace: float, facing: int) -> None:
    """Nobody can tell a body that comes out from behind another from one that is uncovered."""
    edge = (pace * DIRECTIONS[facing, 0], pace * DIRECTIONS[facing, 1])
    x, y = told(covered((0.0, 0.0), edge, facing - 3, 7), UNSEEN)
    assert np.isnan(x) or np.hypot(x, y) <= 2 * NEAR


@some
@given(velocity, velocity, seeds)
def test_an_outline_that_moves_as_one_is_believed_whatever_the_image_says(
    own: Motion, image: Motion, seed: int
) -> None:
    slopes = DIRECTIONS @ own + np.random.default_rng(seed).normal(0.0, 0.3, 16)
    assert told(slopes, (*image, 0.3)) == pytest.approx(own, abs=1.0)


def told_of_cut(
    slopes: Floats, first: int, image: tuple[float, float, float], left_out: int = 5
) -> tuple[Motion, Motion]:
    """Motion of an outline that the image border cuts in some directions, alone and with the image's."""
    usable = ALL.copy()
    usable[np.arange(first, first + left_out) % 16] = False
    outline = common_motion(slopes, usable, DIRECTIONS, 4.5)
    return outline, uncovered_motion(slopes, usable, DIRECTIONS, (outline, image), NEAR)


@some
@given(velocity, st.integers(0, 15), st.integers(5, 10), st.integers(3, 6))
def test_a_body_at_rest_cut_by_the_border_does_not_move_with_what_covers_it(
    edge: Motion, cut: int, off: int, count: int
) -> None:
    slopes = covered((0.0, 0.0), edge, cut + off, count)
    _, (x, y) = told_of_cut(slopes, cut, (0.0, 0.0, 0.3))
    assert np.isnan(x) or np.hypot(x, y) <= 2 * (NEAR + 0.3) + 1e-6


@some
@given(velocity, velocity, st.integers(0, 15))
def test_what_is_cut_by_the_border_and_moves_as_one_is_believed_whatever_the_image_says(
    own: Motion, image: Motion, cut: int
) -> None:
    _, found = told_of_cut(DIRECTIONS @ own, cut, (*image, 0.3))
    assert found == pytest.approx(own, abs=0.5)


@some
@given(velocity, velocity, st.integers(0, 15), st.integers(0, 15), st.integers(0, 9))
def test_without_image_motion_what_is_cut_by_the_border_moves_as_its_outline(
    own: Motion, edge: Motion, cut: int, first: int, count: int
) -> None:
    outline, found = told_of_cut(covered(own, edge, first, count), cut, UNSEEN)
    assert found == pytest.approx(outline, nan_ok=True)


def by_counting(slopes: Floats, outline: Motion, image: tuple[float, float, float]) -> Motion:
    """`uncovered_motion` by arrays, with half outlines fitted by a library's solver."""

    def alike(motion: Floats) -> int:
        off = np.abs(slopes - DIRECTIONS @ motion)
        return int((off <= max(NEAR, UNEVEN * np.hypot(*motion))).sum())

    if np.isfinite(outline[0]) and alike(np.array(outline)) >= AS_ONE * 16:
        return outline
    halves = [(np.arange(9) + first) % 16 for first in range(16)]
    fits = [np.linalg.lstsq(DIRECTIONS[h], slopes[h], rcond=None)[0] for h in halves]
    tried = [m for m in (np.array(outline), np.array(image[:2]), *fits) if np.isfinite(m[0])]
    seen, beside = np.array(image[:2]), max(NEAR + image[2], UNEVEN * np.hypot(*image[:2]))
    scores = []
    for motion in tried:
        count = alike(motion)
        with_image = count >= SOME and np.hypot(*(motion - seen)) <= beside
        scores.append(count + IMAGE_COUNTS * with_image)
    best = int(np.argmax(scores))
    if 2 * scores[best] < 16:
        return outline
    same = 2 * max(NEAR, UNEVEN * np.hypot(*tried[best]))
    for motion, score in zip(tried, scores, strict=True):
        if score > scores[best] - CLEARLY and np.hypot(*(motion - tried[best])) > same:
            return np.nan, np.nan
    return float(tried[best][0]), float(tried[best][1])


@some
@given(velocity, velocity, velocity, st.integers(0, 15), st.integers(0, 12), seeds)
def test_the_motion_is_that_of_a_dumb_twin(
    own: Motion, edge: Motion, image: Motion, first: int, count: int, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    slopes = covered(own, edge, first, count) + rng.normal(0.0, 1.0, 16)
    seen = (*image, 0.5) if rng.random() < 0.7 else UNSEEN
    outline = common_motion(slopes, ALL, DIRECTIONS, 4.5)
    found = uncovered_motion(slopes, ALL, DIRECTIONS, (outline, seen), NEAR)
    assert found == pytest.approx(by_counting(slopes, outline, seen), nan_ok=True, abs=1e-5)


@some
@given(seeds, st.integers(0, 20))
def test_image_motion_is_the_mean_of_what_is_known_if_that_is_more_than_half(
    seed: int, missing: int
) -> None:
    rng, times = np.random.default_rng(seed), np.arange(20) / 25
    image = np.concatenate([rng.normal(0.0, 20.0, (20, 2, 2)), np.ones((20, 2, 1))], axis=2)
    image[rng.permutation(20)[:missing], 1] = np.nan
    found = image_velocity(times, image, (0, 20), 1)
    if 2 * missing >= 20:
        assert np.isnan(found).all()
    else:
        assert found[:2] == pytest.approx(tuple(np.nanmean(image[:, 1, :2], axis=0)))
        assert 0.0 < found[2] <= 1.0

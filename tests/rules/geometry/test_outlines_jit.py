"""Compiled geometry of outlines against dumb twins: all points of one with all points of the other."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from visup.rules.geometry import _outlines_jit as loops
from visup.rules.geometry.regions import DIRECTIONS

Floats = NDArray[np.float64]
some = settings(max_examples=60, deadline=None)
seeds = st.integers(0, 2**32 - 1)


def ring(seed: int, *, at: float = 60.0) -> Floats:
    """A wobbling closed outline of 1 to 150 points, some of them one upon another."""
    rng = np.random.default_rng(seed)
    angle = np.linspace(0.0, 2 * np.pi, int(rng.integers(1, 150)), endpoint=False)
    far = rng.uniform(5, 40) * (1 + 0.3 * np.sin(angle * rng.integers(1, 9)))
    points = np.stack([far * np.cos(angle), far * np.sin(angle)], axis=1) + rng.uniform(0, at, 2)
    return np.rint(points) if rng.random() < 0.5 else points


def apart(first: Floats, second: Floats) -> Floats:
    """Distances of all points of one outline from all of another."""
    far: Floats = np.sqrt(((first[:, None] - second[None]) ** 2).sum(axis=2))
    return far


@some
@given(seeds, seeds, st.floats(0.5, 200.0))
def test_the_least_distance_is_that_of_all_points(one: int, other: int, bound: float) -> None:
    first, second = ring(one), ring(other)
    boxes = loops.run_boxes(first), loops.run_boxes(second)
    found = loops.least_distance(first, boxes[0], second, boxes[1], bound)
    least = apart(first, second).min()
    assert found == pytest.approx(least if least <= bound else np.inf)


@some
@given(seeds, seeds, st.floats(0.5, 30.0))
def test_points_beside_an_outline_are_those_with_a_near_point(
    one: int, other: int, bound: float
) -> None:
    first, second = ring(one), ring(other)
    found = loops.near_outline(first, second, loops.run_boxes(second), bound)
    assert (found == (apart(first, second).min(axis=1) < bound)).all()


@some
@given(seeds, seeds, st.integers(1, 4))
def test_an_outline_reaches_out_of_and_into_a_region_as_its_points_say(
    one: int, other: int, step: int
) -> None:
    first, second = ring(one), ring(other)
    mask = np.random.default_rng(one).random((50, 40)) < 0.5
    points = first[::step]
    far = apart(points, second).min(axis=1)
    at = np.rint(points).astype(int) - (20, 10)
    inside = np.asarray(((at >= 0) & (at < (40, 50))).all(axis=1))
    inside[inside] = mask[at[inside, 1], at[inside, 0]]
    far[inside] *= -1
    boxes = loops.run_boxes(second)
    found = loops.signed_extent(first, step, second, boxes, mask, 20, 10)
    assert found == pytest.approx((far.min(), far.max()))


@some
@given(seeds)
def test_an_outline_reaches_as_far_as_its_furthest_point(seed: int) -> None:
    points = ring(seed, at=30.0)
    support, free = np.empty(16), np.empty(16, dtype=bool)
    loops.outline_support(points, DIRECTIONS, 80.0, 70.0, support, free)
    along = points @ DIRECTIONS.T
    assert np.allclose(support, along.max(axis=0))
    clear = np.asarray(((points > 1.5) & (points < np.array([77.5, 67.5]))).all(axis=1))
    for k in range(16):
        tied = along[:, k] > along[:, k].max() - 1e-9
        assert free[k] in clear[tied]


@some
@given(seeds, st.integers(1, 200))
def test_evenly_spaced_points_are_interpolated_along_the_outline(seed: int, count: int) -> None:
    points = ring(seed)
    closed = np.concatenate([points, points[:1]])
    along = np.append(0.0, np.cumsum(np.hypot(*np.diff(closed, axis=0).T)))
    at = np.linspace(0.0, along[-1], count, endpoint=False)
    expected = np.stack([np.interp(at, along, closed[:, k]) for k in (0, 1)], axis=1)
    assert np.allclose(loops.resampled(points, count), expected, atol=1e-6)


def by_tree(points: Floats, normals: Floats, target: Floats, least: float) -> Floats | None:
    """Iterated closest points by a library's search; None where too few are found."""
    shift = np.zeros(2)
    for _ in range(4):
        far, nearest = cKDTree(target).query(points + shift, distance_upper_bound=12.0)
        found = np.isfinite(far)
        if found.sum() < least:
            return None
        off = target[nearest[found]] - (points + shift)[found]
        known, *move = loops.icp_step(normals[found], off, len(off), 1.5)
        if not known:
            return None
        shift = shift + move
        if max(map(abs, move)) < 0.02:
            break
    return shift


@some
@given(seeds, st.floats(-6, 6), st.floats(-6, 6))
def test_an_outline_is_laid_upon_another_as_by_search_of_all_points(
    seed: int, dx: float, dy: float
) -> None:
    rng = np.random.default_rng(seed)
    points = loops.resampled(ring(seed), 96) + rng.normal(0.0, 1e-3, (96, 2))
    angle = rng.uniform(0.0, 2 * np.pi, 96)
    normals = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    target = points[rng.random(96) < 0.9] + (dx, dy)
    expected = by_tree(points, normals, target, 48.0)
    found, x, y = loops.register(
        points, normals, (0.0, 0.0), target, loops.run_boxes(target), (12.0, 48.0, 1.5)
    )
    assert found == (expected is not None)
    assert expected is None or (x, y) == pytest.approx(tuple(expected), abs=1e-6)

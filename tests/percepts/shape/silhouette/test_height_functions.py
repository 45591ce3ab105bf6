"""Height functions and their alignment, against slow twins."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from tests.percepts.shape.shapes import ZOO, shape
from visup.percepts.shape.silhouette._height_functions_jit import (
    alignment_cost,
    best_diagonals,
    point_costs,
)
from visup.percepts.shape.silhouette.height_functions import (
    HEIGHTS,
    POINTS,
    outline_distances,
    outline_heights,
    stretches,
)
from visup.percepts.shape.silhouette.silhouette import resample_closed

NAMES = sorted(ZOO)
Floats = NDArray[np.float32]


def random_costs(seed: int, count: int) -> Floats:
    return np.random.default_rng(seed).random((count, count), dtype=np.float32)


def slow_heights(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """As the definition says: means of heights over the tangent, each column by its greatest."""
    stops = stretches()
    out = np.empty((POINTS, HEIGHTS))
    for i in range(POINTS):
        tangent = points[(i + 1) % POINTS] - points[i - 1]
        tangent /= np.linalg.norm(tangent)
        over = np.roll(points, -i - 1, axis=0)[:-1] - points[i]
        heights = over @ (-tangent[1], tangent[0])
        out[i] = [heights[a:b].mean() for a, b in pairwise(stops)]
    return np.asarray(out / (np.abs(out).max(axis=0) + 0.05))


def slow_alignment(costs: Floats, diagonal: int, band: int, skip: float) -> float:
    """Every way through the band, best first step to best last."""
    count = len(costs)
    ways = {k: float(costs[0, (diagonal + k) % count]) for k in range(-band, band + 1)}
    for i in range(1, count):
        before = ways
        ways = {
            k: min(
                before.get(k, np.inf),
                before.get(k - 1, np.inf) + skip,
                before.get(k + 1, np.inf) + skip,
            )
            + float(costs[i, (i + diagonal + k) % count])
            for k in before
        }
    return min(ways.values()) / count


def test_heights_equal_their_definition() -> None:
    for name in NAMES:
        contour = shape(ZOO[name]).contour
        slow = slow_heights(resample_closed(np.asarray(contour, float), count=POINTS))
        np.testing.assert_allclose(outline_heights(contour), slow, atol=1e-5)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 999), st.integers(8, 20), st.integers(0, 7), st.integers(1, 3))
def test_alignment_finds_the_cheapest_path(seed: int, count: int, diagonal: int, band: int) -> None:
    costs = random_costs(seed, count)
    lanes = np.empty((3, 2 * band + 1), np.float32)
    found = alignment_cost(costs, diagonal, band, 0.2, lanes)
    assert abs(found - slow_alignment(costs, diagonal, band, 0.2)) < 1e-5


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 999), st.integers(6, 20))
def test_the_best_diagonals_are_the_least_of_the_local_minima(seed: int, count: int) -> None:
    costs = random_costs(seed, count)
    sums = np.array([sum(costs[i, (i + d) % count] for i in range(count)) for d in range(count)])
    least = (sums <= np.roll(sums, 1)) & (sums <= np.roll(sums, -1))
    expected = sorted(np.flatnonzero(least).tolist(), key=lambda d: sums[d])[:3]
    best = np.empty(3, np.intp)
    assert best[: best_diagonals(costs, np.empty(count), best)].tolist() == expected


def test_costs_are_root_mean_squares() -> None:
    rng = np.random.default_rng(4)
    one, other = (rng.random((5, 3), dtype=np.float32) for _ in range(2))
    costs = np.empty((5, 5), np.float32)
    point_costs(one, np.ascontiguousarray(other.T), costs)
    slow = np.sqrt(((one[:, None] - other[None]) ** 2).mean(axis=2))
    np.testing.assert_allclose(costs, slow, rtol=1e-5)


def test_distance_is_invariant_to_starting_point_and_mirroring() -> None:
    own = np.stack([outline_heights(shape(ZOO[n]).contour) for n in NAMES])
    turned, mirrored = np.roll(own, 17, axis=1), own[:, ::-1, ::-1]
    assert outline_distances(own, turned)[:, 0].max() < 1e-5
    assert outline_distances(own, mirrored)[:, 1].max() < 1e-5

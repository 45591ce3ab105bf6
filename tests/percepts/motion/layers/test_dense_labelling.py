"""The linear system of the posterior and the outline made from it, against the slow way."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.percepts.motion.features.test_superpixels_jit import cells_of
from visup.percepts.motion.features.diffusion import solve_symmetric, weighted_laplacian
from visup.percepts.motion.layers.dense_labelling import random_walk
from visup.percepts.motion.outlines.region_outline import region_outline


@given(st.integers(0, 99), st.floats(0.0, 1.0))
@settings(deadline=None, max_examples=15)
def test_what_is_left_out_of_the_system_is_background_all_the_same(seed: int, doubt: float) -> None:
    cells = cells_of(seed)
    rng = np.random.default_rng(seed)
    n = cells.count
    open_ = (rng.random(n) < 0.2 * doubt)[:, None]
    share = np.where(open_, rng.dirichlet(np.ones(3), n), [1, 0, 0]).astype(np.float32)
    prior = np.where(open_, rng.dirichlet(np.ones(3), n), [1, 0, 0]).astype(np.float32)
    weight, trust = rng.random(n).astype(np.float32), np.full(n, 0.2, np.float32)
    bias = np.full(n, 0.02, np.float32)
    link = cells.link.toarray().astype(np.float64)
    system = np.diag(link.sum(axis=1) + weight + trust + bias) - link
    right = share * weight[:, None] + prior * trust[:, None] + np.outer(bias, [1, 0, 0])
    slow = np.linalg.solve(system, right)
    found = random_walk(cells, share, weight, prior, trust, bias)
    assert np.allclose(found.sum(axis=1), 1, atol=1e-5)
    assert np.abs(found - slow).max() < 0.1
    clear = slow.max(axis=1) > 0.6
    assert np.array_equal(found.argmax(axis=1)[clear], slow.argmax(axis=1)[clear])


@given(st.integers(0, 99), st.sampled_from([(), (3,)]))
@settings(deadline=None, max_examples=15)
def test_a_symmetric_system_is_solved(seed: int, columns: tuple[int, ...]) -> None:
    cells = cells_of(seed)
    rng = np.random.default_rng(seed)
    own, right = 0.01 + rng.random(cells.count), rng.random((cells.count, *columns))
    system, beyond = weighted_laplacian(cells.link, np.arange(cells.count), own)
    link = cells.link.toarray().astype(np.float64)
    slow = np.linalg.solve(np.diag(link.sum(axis=1) + own) - link, right)
    assert np.allclose(solve_symmetric(system, right), slow, rtol=1e-6)
    assert np.allclose(beyond, 0, atol=1e-6)  # no cell was left out


@given(st.integers(0, 99), st.integers(-9, 9), st.integers(-9, 9))
@settings(deadline=None, max_examples=15)
def test_cells_are_moved_by_whole_pixels(seed: int, dx: int, dy: int) -> None:
    old, new = cells_of(seed), cells_of(seed + 1)
    members = np.random.default_rng(seed).random(old.count) < 0.1
    map_ = members[old.labels]
    moved = np.zeros_like(map_)
    height, width = map_.shape
    for y, x in zip(*np.nonzero(map_), strict=True):
        if 0 <= y + dy < height and 0 <= x + dx < width:
            moved[y + dy, x + dx] = True
    slow = new.mean(moved.astype(np.float32))
    assert np.allclose(new.shifted(old, members, (dx, dy)), slow, atol=1e-6)


@pytest.mark.parametrize("scale", [1, 2, 3])
def test_an_outline_has_the_size_and_place_of_its_region(scale: int) -> None:
    ys, xs = np.mgrid[:80, :100]
    share = (np.hypot(xs - 60, ys - 35) < 20).astype(np.float32)
    share[35, 60] = 0.0  # a hole
    share[3:5, 3:5] = 1.0  # a speck
    left, top = 2, 1
    found = region_outline(
        share[top:, left:], (left, top), (80, 100), (100 * scale, 80 * scale), 50.0
    )
    assert found is not None
    assert found.area == pytest.approx(np.pi * 20**2 * scale**2, rel=0.03)
    middle = (60 + 0.5) * scale - 0.5, (35 + 0.5) * scale - 0.5
    assert found.centroid == pytest.approx(middle, abs=0.2 * scale)
    assert found.bbox[2] == pytest.approx(39 * scale, abs=scale)
    assert not found.cut


def test_an_outline_needs_the_least_area() -> None:
    share = np.zeros((40, 40), np.float32)
    share[10:14, 10:14] = 1
    assert region_outline(share, (0, 0), (40, 40), (80, 80), 100.0) is None

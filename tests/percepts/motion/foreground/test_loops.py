"""The compiled loops beside their plain twins."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy import sparse

from visup.percepts.motion.foreground._cues_jit import (
    EVERY,
    carried,
    flow_links,
    flow_statistics,
    inside_share,
    neighbour_means,
    warp_errors,
)

SHAPE = (12, 16)
HALF = np.array([0.5], np.float32)
edges = arrays(bool, (6, 7))
cells = arrays(np.int32, SHAPE, elements=st.integers(0, 5))
flows = arrays(np.float32, (*SHAPE, 2), elements=st.floats(-6, 6, width=32))


@given(cells, cells, flows)
@settings(max_examples=30, deadline=None)
def test_links_follow_the_flow(old: np.ndarray, new: np.ndarray, flow: np.ndarray) -> None:
    here, there = flow_links(old, new, flow)
    told = []
    for y in range(0, SHAPE[0], EVERY):
        for x in range(0, SHAPE[1], EVERY):
            u, v = x + int(np.rint(flow[y, x, 0])), y + int(np.rint(flow[y, x, 1]))
            if 0 <= u < SHAPE[1] and 0 <= v < SHAPE[0]:
                told.append((new[y, x], old[v, u]))
    assert list(zip(here.tolist(), there.tolist(), strict=True)) == told


@given(cells, cells, flows)
@settings(max_examples=30, deadline=None)
def test_what_is_carried_is_a_share_of_what_there_was(
    old: np.ndarray, new: np.ndarray, flow: np.ndarray
) -> None:
    here, there = flow_links(old, new, flow)
    looked = np.bincount(new[::EVERY, ::EVERY].ravel(), minlength=6).astype(np.float32)
    ones = carried(here, there, np.ones((6, 1), np.float32), looked)
    assert (ones <= 1 + 1e-6).all()
    values = np.arange(6, dtype=np.float32)[:, None]
    assert (carried(here, there, values, looked) <= 5 * ones + 1e-5).all()
    # Without motion and among the same cells nothing changes.
    here, there = flow_links(new, new, np.zeros_like(flow))
    same = carried(here, there, values, looked)
    assert np.allclose(same[looked > 0], values[looked > 0])


def slow_inside(mask: np.ndarray) -> np.ndarray:
    """The same by walking each ray."""
    height, width = mask.shape
    out = np.zeros(mask.shape)
    for y in range(height):
        for x in range(width):
            for dx, dy in [(i, j) for i in (-1, 0, 1) for j in (-1, 0, 1) if i or j]:
                u, v, row = x, y, []
                while 0 <= u < width and 0 <= v < height:
                    row.append(bool(mask[v, u]))
                    u, v = u + dx, v + dy
                begins = sum(a and not b for a, b in zip(row, [*row[1:], False], strict=True))
                out[y, x] += 0.125 * (begins % 2)
    return out


@given(edges)
@settings(max_examples=40, deadline=None)
def test_rays_agree_with_walking_them(mask: np.ndarray) -> None:
    assert np.allclose(inside_share(mask.astype(np.float32), HALF), slow_inside(mask))


def test_what_is_enclosed_is_inside() -> None:
    mask = np.zeros((20, 30), bool)
    mask[5:15, 8:20] = True
    mask[6:14, 9:19] = False
    share = inside_share(mask.astype(np.float32), HALF)
    assert (share[7:13, 10:18] == 1).all()
    assert share[0, 0] < 0.5


@given(
    arrays(np.float32, (5, 5), elements=st.floats(0, 2, width=32)),
    arrays(np.float32, (5, 2), elements=st.floats(-3, 3, width=32)),
)
@settings(max_examples=30, deadline=None)
def test_means_over_neighbours_are_those_of_the_matrix(
    weights: np.ndarray, values: np.ndarray
) -> None:
    link = sparse.csr_matrix(weights)
    found = neighbour_means(link.indptr, link.indices, link.data, values)
    total = weights.sum(axis=1, keepdims=True) + 1e-6
    assert np.allclose(found, weights @ values / total, atol=1e-3)


def test_a_moved_picture_fits_its_flow_and_not_a_ground_at_rest() -> None:
    rng = np.random.default_rng(0)
    old = rng.integers(0, 255, (40, 60), dtype=np.uint8)
    new = np.roll(old, 3, axis=1)
    flow = np.zeros((40, 60, 2), np.float32)
    flow[..., 0] = -3
    labels = np.zeros((40, 60), np.int32)
    gradient = np.zeros((40, 60), np.float32)
    for ground, fits in (((3.0, 0.0), True), ((0.0, 0.0), False)):
        still, moved = warp_errors(
            labels, (new, old), (gradient, gradient), flow, np.array([ground], np.float32)
        )[0]
        assert (still == pytest.approx(moved)) == fits
        assert moved < 1


def test_statistics_of_a_flow_that_is_even_inside_and_steep_between() -> None:
    labels = np.zeros((10, 12), np.int32)
    labels[:, 6:] = 1
    flow = np.zeros((10, 12, 2), np.float32)
    flow[:, 6:, 0] = 4
    found = flow_statistics(labels, flow, flow[..., 1], flow[..., 1], 2)
    assert found[:, 0].tolist() == [0, 4]
    assert found[0, 2] > 0 == found[1, 2]
    assert found[:, 4].tolist() == [15, 15]

"""Superpixels against the slow way to say the same."""

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import sparse

from visup.agent import Frame
from visup.percepts.motion.features._partition_jit import cell_borders, csr_links, watershed
from visup.percepts.motion.features._superpixels_jit import carry_shares
from visup.percepts.motion.features.superpixels import Superpixels, _edges, superpixels
from visup.percepts.motion.features.work_image import prepare_image


def cells_of(seed: int) -> Superpixels:
    rng = np.random.default_rng(seed)
    image = np.kron(rng.integers(0, 256, (6, 8, 3)), np.ones((12, 12, 1))).astype(np.uint8)
    return superpixels(prepare_image(Frame(0, 0.0, image), 512), 8, 8.0)


@given(st.integers(0, 99), st.booleans())
@settings(deadline=None, max_examples=15)
def test_means_are_means_over_the_pixels(seed: int, sparse: bool) -> None:
    cells = cells_of(seed)
    values = np.random.default_rng(seed).normal(size=cells.labels.shape).astype(np.float32)
    if sparse:
        values[:, 20:] = 0
        values[15:] = 0
    found = cells.mean(values)
    for k in range(cells.count):
        inside = values[cells.labels == k]
        assert found[k] == pytest.approx(inside.mean() if len(inside) else 0, abs=1e-4)
    ys, xs = np.mgrid[: values.shape[0], : values.shape[1]]
    assert np.allclose(cells.centre[:, 0], cells.mean(xs.astype(np.float32)), atol=1e-3)
    assert np.allclose(cells.centre[:, 1], cells.mean(ys.astype(np.float32)), atol=1e-3)


@given(st.integers(0, 99), st.floats(0, 0.3))
@settings(deadline=None, max_examples=15)
def test_boxes_and_maps_of_members(seed: int, share: float) -> None:
    cells = cells_of(seed)
    members = np.random.default_rng(seed).random(cells.count) < share
    mask = members[cells.labels]
    assert np.array_equal(cells.paint(members), mask.astype(np.float32))
    x, y, w, h = cells.box(members)
    assert mask[y : y + h, x : x + w].sum() == mask.sum()
    if mask.any():
        ys, xs = np.nonzero(mask)
        assert (x, y, x + w, y + h) == (xs.min(), ys.min(), xs.max() + 1, ys.max() + 1)
    else:
        assert w * h == 0


@given(st.integers(0, 99))
@settings(deadline=None, max_examples=5)
def test_links_join_those_that_touch(seed: int) -> None:
    cells = cells_of(seed)
    touching = np.zeros((cells.count, cells.count), dtype=bool)
    for a, b in (
        (cells.labels[:, 1:], cells.labels[:, :-1]),
        (cells.labels[1:], cells.labels[:-1]),
    ):
        touching[a[a != b], b[a != b]] = True
    link = cells.link.toarray()
    assert np.array_equal(link > 0, touching | touching.T)
    assert np.array_equal(link, link.T)


@given(st.integers(0, 99), st.integers(-9, 9), st.integers(1, 5))
@settings(deadline=None, max_examples=12)
def test_shares_come_with_every_nth_pixel_of_a_cell(seed: int, shift: int, every: int) -> None:
    old, new = cells_of(seed), cells_of(seed + 1)
    shares = np.random.default_rng(seed).random((old.count, 3)).astype(np.float32)
    flow = np.zeros((*old.labels.shape, 2), np.float32)
    flow[..., 0] = shift + 0.3
    found = carry_shares(old.labels, new.labels, flow, shares, new.area, every)
    width = old.labels.shape[1]
    for k in range(new.count):
        ys, xs = np.nonzero(new.labels == k)
        ys, xs = ys[::every], xs[::every] + shift
        seen = (xs >= 0) & (xs < width)
        come = np.zeros((len(xs), 3))
        come[seen] = shares[old.labels[ys[seen], xs[seen]]]
        assert np.allclose(found[k], come.mean(axis=0) if len(xs) else 0, atol=1e-5)


@given(st.integers(0, 99), st.integers(1, 70), st.integers(0, 4))
@settings(deadline=None, max_examples=12)
def test_reach_is_that_many_steps_along_links(seed: int, kinds: int, steps: int) -> None:
    cells = cells_of(seed)
    members = np.random.default_rng(seed).random((cells.count, kinds)) < 0.1
    near = members
    for _ in range(steps):
        near = (cells.link @ near.astype(float) > 0) | near
    assert np.array_equal(cells.dilated(members, steps), near)


@given(st.integers(0, 99))
@settings(deadline=None, max_examples=5)
def test_borders_are_counted_pixel_by_pixel(seed: int) -> None:
    labels = np.random.default_rng(seed).integers(0, 9, (7, 11)).astype(np.int32)
    slow: dict[tuple[int, int], int] = {}
    for y in range(7):
        for x in range(11):
            for v, u in ((y, x + 1), (y + 1, x)):
                if v < 7 and u < 11 and labels[v, u] != labels[y, x]:
                    a, b = sorted((int(labels[y, x]), int(labels[v, u])))
                    slow[a, b] = slow.get((a, b), 0) + 1
    found = [tuple(map(int, row)) for row in zip(*cell_borders(labels, 9), strict=True)]
    assert found == [(*pair, n) for pair, n in sorted(slow.items())]


@given(st.integers(0, 999), st.integers(1, 12), st.sampled_from([2, 16, 256]))
@settings(deadline=None, max_examples=25)
def test_the_watershed_is_that_of_opencv(seed: int, seeds: int, levels: int) -> None:
    rng = np.random.default_rng(seed)
    tone = (rng.integers(0, levels, (19, 23, 3)) * (255 // (levels - 1))).astype(np.uint8)
    marks = np.zeros(tone.shape[:2], np.int32)
    for k in range(1, seeds + 1):
        y, x = rng.integers(0, 17), rng.integers(0, 21)
        marks[y : y + 2, x : x + 2] = k
    expected = cv2.watershed(tone, marks.copy())
    watershed(*_edges(tone), marks)
    assert np.array_equal(marks, expected)


@given(st.integers(0, 999))
@settings(deadline=None, max_examples=10)
def test_linked_pairs_are_a_symmetric_matrix(seed: int) -> None:
    rng = np.random.default_rng(seed)
    count = 9
    i, j = np.nonzero(np.triu(rng.random((count, count)) < 0.4, 1))
    values = rng.random(len(i)).astype(np.float32)
    ends, columns, data = csr_links(i.astype(np.int32), j.astype(np.int32), values, count)
    both = np.concatenate([i, j]), np.concatenate([j, i])
    expected = sparse.coo_matrix((np.tile(values, 2), both), shape=(count, count)).tocsr()
    assert np.array_equal(ends, expected.indptr)
    assert np.array_equal(columns, expected.indices)
    assert np.array_equal(data, expected.data)

"""Superpixels against the slow way to say the same."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from visup.agent import Frame
from visup.percepts.motion.image import prepare
from visup.percepts.motion.superpixels import Superpixels, overlap, superpixels


def cells_of(seed: int) -> Superpixels:
    rng = np.random.default_rng(seed)
    image = np.kron(rng.integers(0, 256, (6, 8, 3)), np.ones((12, 12, 1))).astype(np.uint8)
    return superpixels(prepare(Frame(0, 0.0, image), 512), 8, 8.0)


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


@given(st.integers(0, 99), st.integers(-9, 9))
@settings(deadline=None, max_examples=8)
def test_overlap_carries_shares_with_their_pixels(seed: int, shift: int) -> None:
    old, new = cells_of(seed), cells_of(seed + 1)
    source = np.roll(old.labels, shift, axis=1)
    source[:, : max(shift, 0)] = -1
    share = np.random.default_rng(seed).random(old.count).astype(np.float32)
    carried = np.where(source >= 0, share[source], 0).astype(np.float32)
    places, ends = new.samples(1)
    step = overlap(old, new, source.ravel()[places], ends)
    assert np.allclose(step @ share, new.mean(carried), atol=1e-5)


@given(st.integers(0, 99), st.integers(1, 5))
@settings(deadline=None, max_examples=8)
def test_samples_are_every_nth_pixel_of_each_cell(seed: int, every: int) -> None:
    cells = cells_of(seed)
    places, ends = cells.samples(every)
    for k in range(cells.count):
        inside = np.flatnonzero(cells.labels.ravel() == k)
        assert np.array_equal(places[ends[k] : ends[k + 1]], inside[::every])

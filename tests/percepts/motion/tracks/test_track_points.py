"""Compiled loops over points and tracks against the slow way to say the same."""

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from tests.percepts.motion.features.test_superpixels_jit import cells_of
from tests.percepts.motion.layers.test_affine import made, some_motion
from visup.percepts.motion.features._superpixels_jit import connected_groups
from visup.percepts.motion.layers.affine import Affine, distances, log_likelihood
from visup.percepts.motion.tracks._track_points_jit import (
    Motions,
    add_track_likelihoods,
    assigned,
    drop_explained,
    hidden_before,
)
from visup.percepts.motion.tracks.track_prediction import shift_map

TRACKS, LEAST, FAR, COST = 4, -18.0, 16.0, 4.0


def some_parts(seed: int) -> tuple[list[list[tuple[Affine, float]]], Motions]:
    """One to three parts of each track, with their errors, and the same as compiled loops take them."""
    rng = np.random.default_rng(seed)
    parts = [
        [
            (some_motion(seed + 7 * k + p), 0.1 + float(rng.random()))
            for p in range(rng.integers(1, 4))
        ]
        for k in range(TRACKS)
    ]
    every = [part for own in parts for part in own]
    begin = np.cumsum([0, *map(len, parts)])
    return parts, (np.array([m.matrix for m, _ in every]), np.array([s for _, s in every]), begin)


@given(st.integers(0, 999))
@settings(deadline=None, max_examples=15)
def test_points_are_as_likely_as_under_the_likeliest_part(seed: int) -> None:
    rng, c = np.random.default_rng(seed), made(seed, some_motion(seed), wrong=0.4)
    parts, motions = some_parts(seed)
    c = c.take(np.flatnonzero(rng.random(len(c)) < 0.7))
    reach = rng.random((300, TRACKS)) < 0.6
    before = rng.normal(size=(300, TRACKS + 2)).astype(np.float32)
    expected, found = before.copy(), before.copy()
    for k, own in enumerate(parts):
        best = np.max([log_likelihood(m, c, slack) for m, slack in own], axis=0)
        expected[c.index, k + 1] += np.where(reach[c.index, k], np.maximum(best, LEAST), LEAST)
    add_track_likelihoods(found, c.index, (c.xy, c.moved, c.information), reach, motions, LEAST)
    assert found == pytest.approx(expected, abs=1e-5)


@given(st.integers(0, 999))
@settings(deadline=None, max_examples=15)
def test_what_a_track_near_by_explains_is_not_free(seed: int) -> None:
    rng, c = np.random.default_rng(seed), made(seed, some_motion(seed), wrong=0.4)
    parts, motions = some_parts(seed)
    near, free = rng.random((300, TRACKS)) < 0.5, rng.random(300) < 0.8
    explained = np.zeros(300, dtype=bool)
    for k, own in enumerate(parts):
        for m, slack in own:
            explained |= near[:, k] & (distances(m, c, slack) < FAR)
    expected = free & ~explained
    drop_explained(free, (c.xy, c.moved, c.information), near, motions, FAR)
    assert np.array_equal(free, expected)


@given(st.integers(0, 999))
@settings(deadline=None, max_examples=15)
def test_constraints_go_to_the_nearest_part_and_the_first_is_preferred(seed: int) -> None:
    c = made(seed, some_motion(seed), wrong=0.4)
    ground = np.random.default_rng(seed).random(300).astype(np.float32) * np.float32(8)
    for own in some_parts(seed)[0]:
        off = np.stack([distances(m, c, slack) for m, slack in own])
        off[1:] += np.float32(COST)
        may = (off.min(axis=0) < 9) | (ground > 4)
        may = may if np.count_nonzero(may) > 150 else np.ones_like(may)
        matrices, slacks = np.array([m.matrix for m, _ in own]), np.array([s for _, s in own])
        found, nearest = assigned((c.xy, c.moved, c.information), ground, matrices, slacks, COST)
        assert np.array_equal(found, may)
        assert np.array_equal(nearest, off.argmin(axis=0))


@given(st.integers(0, 999))
@settings(deadline=None, max_examples=15)
def test_a_cell_was_hidden_where_the_track_was_before(seed: int) -> None:
    rng, cells = np.random.default_rng(seed), cells_of(seed % 20)
    owner = rng.integers(0, 3, cells.count)
    which = np.flatnonzero(rng.random(cells.count) < 0.5)
    away = rng.normal(0, 9, (len(which), 2)).astype(np.float32)
    height, width = cells.labels.shape
    length = np.hypot(away[:, :1], away[:, 1:])
    at = cells.centre[which] + 1.2 * (away + 2.0 * away / np.maximum(length, 1e-3))
    x, y = np.rint(at).astype(int).T
    expected = owner[cells.labels[np.clip(y, 0, height - 1), np.clip(x, 0, width - 1)]] == 1
    found = hidden_before(cells.labels, owner, cells.centre, which, away, 1)
    assert np.count_nonzero(found != expected) <= 1  # half a pixel may be rounded either way


@given(st.integers(0, 999), st.floats(0, 1))
@settings(deadline=None, max_examples=15)
def test_groups_are_the_connected_components(seed: int, share: float) -> None:
    link = cells_of(seed % 20).link
    members = np.random.default_rng(seed).random(link.shape[0]) < share
    which = np.flatnonzero(members)
    count, number = connected_components(sparse.csr_matrix(link)[which][:, which], directed=False)
    found, groups = connected_groups(link.indptr, link.indices, members)
    assert groups == count
    assert np.array_equal(found[which], number)
    assert (found[~members] == -1).all()


@given(st.integers(-40, 40), st.integers(-40, 40))
@settings(deadline=None, max_examples=20)
def test_a_shifted_map_is_a_warped_one(dx: int, dy: int) -> None:
    image = np.random.default_rng(0).random((24, 31)).astype(np.float32)
    matrix = np.array([[1, 0, dx], [0, 1, dy]], dtype=np.float64)
    warped = cv2.warpAffine(image, matrix, image.shape[::-1], flags=cv2.INTER_NEAREST)
    assert np.array_equal(shift_map(image, dx, dy), warped)

"""Beliefs: what context does to cues."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import sparse

from visup.percepts.motion.foreground._cues_jit import smooth_untextured
from visup.percepts.motion.foreground.belief import (
    ALONE_NEAR,
    CUES_IN_CONTEXT,
    PAST,
    TOGETHER,
    belief_from_log_odds,
    context_cues,
    initial_belief,
)
from visup.percepts.motion.foreground.cues import NAMES, FrameCues, tone_bins

COUNT = 60


ONE_PART = np.zeros(COUNT, np.int32)


def frame(tones: np.ndarray, first: bool = False, part: np.ndarray = ONE_PART) -> FrameCues:
    ones = np.ones(COUNT - 1, np.float32)
    link = sparse.diags([ones, ones], [-1, 1], format="csr")
    cells = np.arange(0 if first else COUNT, dtype=np.int32)
    return FrameCues(
        np.zeros((COUNT, len(NAMES)), np.float32),
        np.full(COUNT, 64, np.float32),
        tone_bins(tones),
        link.indptr,
        link.indices,
        link.data,
        cells,
        cells,
        np.ones(COUNT, np.float32),
        part,
    )


def two_tones() -> np.ndarray:
    tones = np.full((COUNT, 3), 40.0, np.float32)
    tones[20:30] = 200
    return tones


def test_the_past_speaks_for_where_something_moved_and_tones_for_what_looks_like_it() -> None:
    odds = np.full(COUNT, -4.0, np.float32)
    odds[20:30] = 4
    belief = initial_belief()
    for n in range(3):
        belief = belief_from_log_odds(belief, frame(two_tones(), first=not n), odds, odds)
    assert belief.share.min() >= 0
    assert belief.share.max() <= 1
    elsewhere = two_tones()
    elsewhere[40:45] = 200
    context = context_cues(belief, frame(elsewhere), np.zeros(COUNT, np.float32))
    past, tones = context[:, PAST], context[:, PAST + 2]
    assert past[20:30].min() > 0 > past[:20].max()
    assert past[40:45].max() < 0 < tones[40:45].min()
    assert tones[:20].max() < 0


def test_neighbours_are_told_of() -> None:
    alone = np.zeros(COUNT, np.float32)
    alone[30] = 8
    near = context_cues(initial_belief(), frame(two_tones(), first=True), alone)[:, ALONE_NEAR]
    assert np.flatnonzero(near > 0).tolist() == [29, 31]


@given(st.integers(0, 1000))
@settings(max_examples=20, deadline=None)
def test_what_goes_together_speaks_as_one_whatever_its_number(seed: int) -> None:
    rng = np.random.default_rng(seed)
    part = rng.integers(0, 4, COUNT).astype(np.int32)
    alone = rng.normal(size=COUNT).astype(np.float32)
    told = context_cues(initial_belief(), frame(two_tones(), True, part), alone)
    other = context_cues(
        initial_belief(), frame(two_tones(), True, (3 - part).astype(np.int32)), alone
    )
    assert np.allclose(told, other, atol=1e-5)
    for k in np.unique(part):
        assert np.allclose(told[part == k, TOGETHER], alone[part == k].mean(), atol=1e-5)
    assert told.shape[1] == CUES_IN_CONTEXT


@given(st.integers(0, 1000))
@settings(max_examples=20, deadline=None)
def test_settling_solves_the_linear_system(seed: int) -> None:
    rng = np.random.default_rng(seed)
    weights = rng.uniform(0, 1, (6, 6)).astype(np.float32)
    weights = np.triu(weights, 1) + np.triu(weights, 1).T
    values = rng.normal(size=(6, 1)).astype(np.float32)
    trust = rng.uniform(0.2, 1, (6, 1)).astype(np.float32)
    link = sparse.csr_matrix(weights)
    found = smooth_untextured(link.indptr, link.indices, link.data, values, trust, 60)
    system = np.diag(weights.sum(axis=1) + trust[:, 0]) - weights
    assert np.allclose(found, np.linalg.solve(system, trust * values), atol=1e-3)
    assert found.min() >= values.min() - 1e-4
    assert found.max() <= values.max() + 1e-4

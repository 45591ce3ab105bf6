"""Layers: motions are found again from constraints, whatever does not belong to them."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from visup.percepts.motion.features.motion_constraints import Constraints
from visup.percepts.motion.layers.affine import STILL, Affine, distances, fit_affine, fit_bent
from visup.percepts.motion.layers.dominant_motion import fit_dominant


def made(seed: int, motion: Affine, wrong: float = 0.0) -> Constraints:
    """Corners and edges that move as told, but for a share of them."""
    rng = np.random.default_rng(seed)
    xy = (rng.random((300, 2)) * [320, 240]).astype(np.float32)
    moved = motion.at(xy)
    lost = rng.random(300) < wrong
    moved[lost] += rng.normal(0, 20, (int(lost.sum()), 2)).astype(np.float32)
    angle, weak = rng.random(300) * np.pi, np.where(rng.random(300) < 0.5, 0.01, 50.0)
    c, s = np.cos(angle), np.sin(angle)
    info = np.stack([50 * c * c + weak * s * s, (50 - weak) * c * s, 50 * s * s + weak * c * c], 1)
    return Constraints(1, 0.04, np.arange(300), xy, moved, info.astype(np.float32))


def some_motion(seed: int) -> Affine:
    rng = np.random.default_rng(seed)
    return Affine(np.column_stack([rng.normal(0, 0.02, (2, 2)), rng.normal(0, 4, 2)]))


@given(st.integers(0, 999))
@settings(deadline=None, max_examples=20)
def test_the_dominant_motion_is_found_among_wrong_ones(seed: int) -> None:
    motion = some_motion(seed)
    c = made(seed, motion, wrong=0.4)
    found = fit_dominant(c, np.ones(300, np.float32), (Affine(STILL),), seed)
    assert np.abs(found.at(c.xy) - motion.at(c.xy)).max() < 0.3


@given(st.integers(0, 999))
@settings(deadline=None, max_examples=20)
def test_what_has_no_weight_has_no_say(seed: int) -> None:
    c = made(seed, some_motion(seed))
    weight = (np.arange(300) < 80).astype(np.float32)
    fit = fit_affine(c, weight, Affine(STILL), slack=0.3, rounds=6)
    alone = fit_affine(c.take(np.arange(80)), weight[:80], Affine(STILL), slack=0.3, rounds=6)
    assert fit.matrix == pytest.approx(alone.matrix, abs=1e-9)
    assert fit.support == pytest.approx(alone.support)
    assert fit.support > 0


@given(st.integers(0, 999))
@settings(deadline=None, max_examples=20)
def test_a_bent_motion_is_found_and_displaces_as_its_formula_says(seed: int) -> None:
    rng = np.random.default_rng(seed)
    plain = some_motion(seed)
    motion = Affine(plain.matrix, bend=rng.normal(0, 0.05, (2, 3)))
    c = made(seed, motion)
    x, y = c.xy.T.astype(np.float64)
    by_hand = motion.matrix @ np.stack([x, y, np.ones_like(x)])
    by_hand += motion.bend @ np.stack([x * x, x * y, y * y]) / 1000
    assert np.abs(motion.at(c.xy) - by_hand.T).max() < 1e-3
    start = fit_affine(c, np.ones(300, np.float32), Affine(STILL), rigidity=0.02, rounds=5)
    found = fit_bent(c, np.full(300, 20, np.float32), start)
    assert np.median(distances(found, c, 0.15)) < 0.1

"""Random samples of constraints, and what a motion explains, against the slow way to say the same."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.percepts.motion.layers.test_affine import made, some_motion
from tests.percepts.motion.test_compiled_loops import matrices
from visup.percepts.motion.features.motion_constraints import mahalanobis
from visup.percepts.motion.layers._dominant_motion_jit import (
    HOLD,
    UNIT,
    explained_weights,
    sample_fits,
)


@given(st.integers(0, 999))
@settings(deadline=None, max_examples=15)
def test_a_sample_is_fitted_by_its_normal_equations(seed: int) -> None:
    c = made(seed, some_motion(seed))
    pick = np.random.default_rng(seed).integers(0, 300, (5, 4))
    for found, at in zip(sample_fits(c.xy, c.moved, c.information, pick), pick, strict=True):
        centre = c.xy[at].astype(np.float64).mean(axis=0)
        normal, right = HOLD * np.eye(6), np.zeros(6)
        for n, both in zip(at, matrices(c.information[at]), strict=True):
            rows = np.kron(np.eye(2), [*(c.xy[n] - centre) / UNIT, 1.0])
            normal += rows.T @ both @ rows
            right += rows.T @ both @ c.moved[n]
        model = np.linalg.solve(normal, right).reshape(2, 3)
        middle = found @ [*centre, 1.0]
        assert found[:, :2] * UNIT == pytest.approx(model[:, :2], rel=1e-3, abs=1e-3)
        assert middle == pytest.approx(model[:, 2], rel=1e-3, abs=1e-3)


@given(st.integers(0, 999))
@settings(deadline=None, max_examples=15)
def test_a_motion_explains_the_weight_of_what_is_near_to_it(seed: int) -> None:
    rng, c = np.random.default_rng(seed), made(seed, some_motion(seed), wrong=0.3)
    weight = rng.random(300).astype(np.float32)
    models = [some_motion(seed + k) for k in range(4)]
    expected = [
        np.maximum(0, 1 - mahalanobis(m.at(c.xy) - c.moved, c.information) / 12) @ weight
        for m in models
    ]
    by_coefficient = np.stack([m.matrix for m in models], axis=2).astype(np.float32)
    found = explained_weights(c.xy, c.moved, c.information, weight, by_coefficient, 12.0)
    assert found == pytest.approx(np.array(expected), rel=1e-2, abs=1e-2)
    assert np.argmax(found) == 0

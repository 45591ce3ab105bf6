"""Rotations by many, against SciPy's."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from visup.rules.pose.rotations import (
    nearest_rotations,
    right_jacobian,
    rotation_matrices,
    rotation_vectors,
)

vectors = st.lists(st.floats(-1.7, 1.7), min_size=3, max_size=3).map(np.array)


@given(vectors)
def test_rotations_are_those_of_scipy(v: np.ndarray) -> None:
    assert np.allclose(rotation_matrices(v), Rotation.from_rotvec(v).as_matrix())


@given(vectors)
def test_vectors_come_back(v: np.ndarray) -> None:
    assert np.allclose(rotation_vectors(rotation_matrices(v)), v, atol=1e-7)


def test_half_a_turn_is_never_taken_for_none() -> None:
    halves = np.stack([np.diag([1.0, -1.0, -1.0]), np.diag([-1.0, -1.0, 1.0]), np.eye(3)])
    lengths = np.linalg.norm(rotation_vectors(halves), axis=1)
    assert lengths.tolist() == pytest.approx([np.pi, np.pi, 0.0])


@given(vectors, vectors)
def test_a_small_change_turns_by_the_jacobian(v: np.ndarray, change: np.ndarray) -> None:
    d = 1e-5 * change
    assert np.allclose(
        rotation_matrices(v + d),
        rotation_matrices(v) @ rotation_matrices(right_jacobian(v) @ d),
        atol=1e-8,
    )


@given(vectors, st.integers(0, 1000))
def test_the_nearest_rotation_undoes_small_noise(v: np.ndarray, seed: int) -> None:
    noise = 0.05 * np.random.default_rng(seed).normal(size=(3, 3))
    found = nearest_rotations(rotation_matrices(v) + noise)
    assert np.allclose(found @ found.T, np.eye(3))
    assert np.linalg.det(found) == pytest.approx(1)
    assert np.linalg.norm(rotation_vectors(found @ rotation_matrices(v).T)) < 0.3

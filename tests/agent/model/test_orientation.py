"""Orientations: from a view and its turn in the plane and back; how far apart two are."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from visup.agent.model.orientation import image_axes, orientations, swing_and_roll, views

seeds = st.integers(0, 10_000)
angles = st.floats(-3.1, 3.1)


def any_rotation(seed: int) -> np.ndarray:
    return np.asarray(Rotation.random(random_state=seed).as_matrix())


@given(seeds)
def test_an_orientation_is_that_of_its_view(seed: int) -> None:
    orientation = any_rotation(seed)
    assert np.allclose(orientations(*views(orientation)), orientation)


@given(seeds, angles)
def test_a_view_is_that_of_its_orientation(seed: int, angle: float) -> None:
    direction = any_rotation(seed)[0]
    seen, rotation = views(orientations(direction, angle))
    assert np.allclose(seen, direction)
    assert rotation == pytest.approx(angle)


@given(seeds, angles)
def test_orientations_are_proper_rotations_with_the_viewer_in_front(
    seed: int, angle: float
) -> None:
    direction = any_rotation(seed)[1]
    matrix = orientations(direction, angle)
    assert np.allclose(matrix @ matrix.T, np.eye(3))
    assert np.linalg.det(matrix) == pytest.approx(1)
    # The camera looks along +z: what points to the viewer has z = -1.
    assert np.allclose(matrix @ direction, [0, 0, -1])


@pytest.mark.parametrize("pole", [(0, 0, 1), (0, 0, -1)])
def test_along_the_pole_y_is_up(pole: tuple[int, int, int]) -> None:
    right, up = image_axes(pole)
    assert np.allclose(up, [0, 1, 0])
    assert np.allclose(np.cross(right, up), pole)


@given(seeds)
def test_the_image_from_behind_is_mirrored(seed: int) -> None:
    direction = any_rotation(seed)[2]
    (right, up), (right_behind, up_behind) = image_axes(direction), image_axes(-direction)
    assert np.allclose(right, -right_behind)
    assert np.allclose(up, up_behind)


@given(seeds, st.floats(0.0, 3.0), angles, angles)
def test_swing_and_roll_recover_the_applied_rotation(
    seed: int, swing: float, about: float, roll: float
) -> None:
    before = any_rotation(seed)
    axis = np.array([np.cos(about), np.sin(about), 0.0])
    after = (Rotation.from_rotvec([0, 0, roll]) * Rotation.from_rotvec(swing * axis)).as_matrix()
    found = swing_and_roll(before, after @ before)
    assert found[0] == pytest.approx(swing, abs=1e-6)
    assert found[1] == pytest.approx(roll, abs=1e-6)


def test_batched_orientations_equal_single_ones() -> None:
    directions = Rotation.random(7, random_state=1).as_matrix()[:, 0]
    turns = np.linspace(-3, 3, 7)
    together = orientations(directions, turns)
    assert together.shape == (7, 3, 3)
    for k in range(7):
        assert np.allclose(together[k], orientations(directions[k], turns[k]))

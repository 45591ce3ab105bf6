"""Trajectories, kinematics of the arm, and meshes."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from visup.agent.model.errors import SettingsError
from visup.render.meshes import arm
from visup.render.meshes.arm import Joints, inverse_kinematics, link_poses, tip_pose
from visup.render.meshes.distractors import DISTRACTORS
from visup.render.meshes.solids import Solid, ball, box, cone, lathe, mirrored, plate
from visup.render.meshes.spacecraft import MESHES, mesh
from visup.render.scenario.trajectories import (
    camera_shake,
    inverse,
    look_at,
    pose_of,
    rotation_at,
    value_at,
)

angle = st.floats(-3.0, 3.0)
small = st.floats(-1.2, 1.2)


@settings(max_examples=60, deadline=None)
@given(
    tip=st.tuples(st.floats(-9, 9), st.floats(-9, 9), st.floats(-5, 8)),
    toward=st.tuples(small, small, small),
    roll=angle,
    up=st.booleans(),
)
def test_inverse_kinematics_reaches_the_requested_tip_pose(
    tip: tuple[float, float, float],
    toward: tuple[float, float, float],
    roll: float,
    up: bool,
) -> None:
    assume(np.linalg.norm(toward) > 0.1)
    target = np.array(tip)
    try:
        joints = inverse_kinematics(target, np.array(toward), roll, up)
    except SettingsError:
        return
    pose = tip_pose(joints)
    np.testing.assert_allclose(pose[:3, 3], target, atol=1e-6)
    np.testing.assert_allclose(pose[:3, 0] * np.linalg.norm(toward), toward, atol=1e-6)
    elbow, shoulder, wrist = (link_poses(joints)[k][:3, 3] for k in (2, 1, 3))
    elbow_offset = elbow - (shoulder + wrist) / 2
    # The elbow is on the requested side, above or below in the plane of the arm.
    out = np.array([np.cos(joints.shoulder_yaw), np.sin(joints.shoulder_yaw), 0])
    to_wrist = wrist - shoulder
    turn = (to_wrist @ out) * elbow_offset[2] - to_wrist[2] * (elbow_offset @ out)
    assert (turn > -1e-9) if up else (turn < 1e-9)


@settings(max_examples=30, deadline=None)
@given(joints=st.builds(Joints, angle, angle, angle, angle, angle, angle))
def test_links_have_constant_lengths(joints: Joints) -> None:
    places = [pose[:3, 3] for pose in link_poses(joints)]
    lengths = [np.linalg.norm(b - a) for a, b in pairwise(places)]
    expected = [arm.FOOT, arm.UPPER, arm.LOWER, arm.WRIST, arm.HAND, arm.TOOL]
    np.testing.assert_allclose(lengths, expected, atol=1e-9)
    assert sum(expected) == pytest.approx(15.2)


@pytest.mark.parametrize("tip", [(30.0, 0.0, 0.0), (0.0, 0.0, 20.0)])
def test_positions_out_of_reach_are_reported(tip: tuple[float, float, float]) -> None:
    with pytest.raises(SettingsError, match="cannot reach"):
        inverse_kinematics(np.array(tip), np.array([1.0, 0.0, 0.0]))


@settings(max_examples=30, deadline=None)
@given(t=st.floats(0, 10), smooth=st.booleans())
def test_values_pass_through_their_keys_without_overshoot(t: float, smooth: bool) -> None:
    times, values = np.array([1.0, 3.0, 7.0]), np.array([[0.0, 5.0], [4.0, 5.0], [10.0, -1.0]])
    at = value_at(times, values, t, smooth)
    assert (at >= values.min(axis=0) - 1e-9).all()
    assert (at <= values.max(axis=0) + 1e-9).all()
    for k, key in enumerate(times):
        np.testing.assert_allclose(value_at(times, values, key, smooth), values[k], atol=1e-12)


def test_rotation_between_keys_has_constant_speed() -> None:
    keys = Rotation.from_euler("z", [[0], [90]], degrees=True)
    angles = [rotation_at(np.array([0.0, 9.0]), keys, t).magnitude() for t in (0, 1, 4.5, 9, 12)]
    np.testing.assert_allclose(np.degrees(angles), [0, 10, 45, 90, 90], atol=1e-9)


@settings(max_examples=30, deadline=None)
@given(position=st.tuples(angle, angle, angle), target=st.tuples(angle, angle, angle))
def test_the_target_is_in_the_image_centre_and_up_points_up(
    position: tuple[float, float, float], target: tuple[float, float, float]
) -> None:
    assume(np.hypot(target[0] - position[0], target[1] - position[1]) > 0.1)
    camera = inverse(pose_of(np.array(position), look_at(position, target, (0, 0, 1))))
    in_camera = camera @ [*target, 1]
    np.testing.assert_allclose(in_camera[:2], 0, atol=1e-9)
    assert in_camera[2] > 0
    assert (camera @ [*np.add(target, (0, 0, 0.01)), 1])[1] < 0


def test_camera_shake_is_small_and_depends_on_its_seed() -> None:
    turns = [np.degrees(camera_shake(t, 0.1, 1.0, 4).magnitude()) for t in np.linspace(0, 20, 400)]
    assert 0.05 < np.std(turns) + np.mean(turns) < 0.3
    assert camera_shake(1.7, 0.1, 1.0, 4).magnitude() == camera_shake(1.7, 0.1, 1.0, 4).magnitude()
    assert camera_shake(1.7, 0.1, 1.0, 4).magnitude() != camera_shake(1.7, 0.1, 1.0, 5).magnitude()


def volume(solid: Solid) -> float:
    a, b, c = (solid.vertices[solid.faces[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)


@pytest.mark.parametrize(
    ("solid", "expected"),
    [
        (box((1, 2, 3)), 6.0),
        (ball(1.0, detail=5), 4 / 3 * np.pi),
        (ball((1.0, 2.0, 0.5), (3, 1, 1), detail=5), 4 / 3 * np.pi),
        (cone((0, 0, 0), (0, 3, 4), 0.5), np.pi * 0.25 * 5),
        (cone((1, 0, 0), (0, 0, 0), 0.5, 0.0), np.pi * 0.25 / 3),
        (lathe([(0, 0), (1, 0), (1, 2), (0, 2)]), 2 * np.pi),
        (plate([(0, 0), (2, 0), (2, 1), (0, 1)], 0.5), 1.0),
        (mirrored(box((1, 1, 1), (0, 3, 0))), 2.0),
        (box((1, 1, 1)).moved(by=(4, 0, 0), turn=(20, 30, 40), scale=2.0), 8.0),
    ],
)
def test_primitives_face_outwards_and_have_their_volume(solid: Solid, expected: float) -> None:
    assert volume(solid) == pytest.approx(expected, rel=0.01)


def test_there_are_seventeen_distractors() -> None:
    assert len(DISTRACTORS) == 17
    assert not {"spartan", "arm", "payload_bay"} & set(DISTRACTORS)


@pytest.mark.parametrize("name", sorted(MESHES))
def test_meshes_are_valid(name: str) -> None:
    solid = mesh(name)
    assert np.isfinite(solid.vertices).all()
    assert solid.faces.max() < len(solid.vertices)
    assert solid.albedo.shape == (len(solid.faces), 3)
    assert 0 <= solid.albedo.min() <= solid.albedo.max() <= 1


def test_spartan_has_its_documented_size() -> None:
    solid = mesh("spartan")
    assert np.ptp(solid.vertices[:, 2]) == pytest.approx(3.1, abs=0.01)
    assert np.ptp(solid.vertices[:, 1]) == pytest.approx(1.8, abs=0.01)
    assert np.ptp(solid.vertices[:, 0]) == pytest.approx(3.0, abs=0.01)

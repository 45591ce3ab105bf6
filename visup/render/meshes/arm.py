"""The robot arm: forward and inverse kinematics of its six joints, and its mesh.

The arm's frame has its origin at the foot of the shoulder, z along the axis of the shoulder's yaw, and
x along the arm stretched out at angle zero. Joints in order: shoulder yaw, shoulder pitch, elbow
pitch, wrist pitch, wrist yaw, wrist roll. Pitch lifts for positive angles.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from math import acos, atan2, cos, pi, sin

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from visup.agent.model.errors import SettingsError
from visup.render.meshes.solids import Colour, Solid, ball, box, cone, join

FOOT, UPPER, LOWER, WRIST, HAND, TOOL = 0.30, 6.10, 6.50, 0.46, 0.46, 1.38
"""Metres between neighbouring joints, and from the last joint to the tip: 15.2 in all."""

LENGTH = FOOT + UPPER + LOWER + WRIST + HAND + TOOL
THICKNESS = 0.38
"""Diameter of the booms, metres."""

BLANKET: Colour = (0.72, 0.71, 0.68)
HOUSING: Colour = (0.50, 0.50, 0.52)
DARK: Colour = (0.22, 0.22, 0.24)


@dataclass(frozen=True, slots=True)
class Joints:
    """Angles of the six joints, radians."""

    shoulder_yaw: float = 0.0
    shoulder_pitch: float = 0.0
    elbow_pitch: float = 0.0
    wrist_pitch: float = 0.0
    wrist_yaw: float = 0.0
    wrist_roll: float = 0.0


def link_poses(joints: Joints) -> list[NDArray[np.float64]]:
    """Forward kinematics: the poses of the links.

    Args:
        joints: The angles.

    Returns:
        Seven (4, 4) poses in the arm's frame: shoulder, upper boom, lower boom, wrist, hand, tool, tip.
        Each has its origin in its joint and x along its link.
    """
    steps = (
        ((0.0, 0.0, 0.0), "z", joints.shoulder_yaw),
        ((0.0, 0.0, FOOT), "y", -joints.shoulder_pitch),
        ((UPPER, 0.0, 0.0), "y", -joints.elbow_pitch),
        ((LOWER, 0.0, 0.0), "y", -joints.wrist_pitch),
        ((WRIST, 0.0, 0.0), "z", joints.wrist_yaw),
        ((HAND, 0.0, 0.0), "x", joints.wrist_roll),
        ((TOOL, 0.0, 0.0), "x", 0.0),
    )
    poses, pose = [], np.eye(4)
    for offset, axis, angle in steps:
        step = np.eye(4)
        step[:3, :3] = Rotation.from_euler(axis, angle).as_matrix()
        step[:3, 3] = offset
        pose = pose @ step
        poses.append(pose)
    return poses


def tip_pose(joints: Joints) -> NDArray[np.float64]:
    """The (4, 4) pose of the tip in the arm's frame, x pointing out of the end effector."""
    return link_poses(joints)[-1]


def inverse_kinematics(
    tip: NDArray[np.float64],
    direction: NDArray[np.float64],
    roll: float = 0.0,
    elbow_up: bool = True,
) -> Joints:
    """Inverse kinematics: the angles for a position and direction of the tip.

    The axes of the three pitch joints are parallel, so the booms and the first wrist link lie in one
    plane with the yaw axis of the shoulder; the wrist's yaw alone leads out of that plane.

    Args:
        tip: (3,) metres, in the arm's frame.
        direction: (3,) direction of the end effector, any length but zero.
        roll: Radians, of the wrist.
        elbow_up: Which of the two solutions to take.

    Returns:
        The angles.

    Raises:
        SettingsError: The position is out of reach.
    """
    d = np.asarray(direction, float) / np.linalg.norm(direction)
    wrist_yaw_at = np.asarray(tip, float) - (HAND + TOOL) * d
    yaw = atan2(wrist_yaw_at[1], wrist_yaw_at[0])
    radial, tangential = np.array([cos(yaw), sin(yaw), 0.0]), np.array([-sin(yaw), cos(yaw), 0.0])
    in_plane = np.array([float(d @ radial), float(d[2])])
    in_plane_length = float(np.linalg.norm(in_plane))
    if in_plane_length < 1e-9:
        raise SettingsError("the arm cannot point straight across its own plane")
    along = in_plane / in_plane_length
    planar = np.array([float(wrist_yaw_at @ radial), wrist_yaw_at[2] - FOOT]) - WRIST * along
    shoulder, elbow = _two_links(planar, elbow_up)
    return Joints(
        yaw,
        shoulder,
        elbow,
        _wrap_angle(atan2(along[1], along[0]) - shoulder - elbow),
        atan2(float(d @ tangential), in_plane_length),
        roll,
    )


def arm_solid(joints: Joints) -> Solid:
    """The arm at given angles, in its own frame, metres."""
    poses = link_poses(joints)
    return join(*(link.transformed(p) for link, p in zip(_links(), poses[:6], strict=True)))


def _two_links(target: NDArray[np.float64], elbow_up: bool) -> tuple[float, float]:
    """Shoulder and elbow pitch that bring the end of both booms to a point of the plane."""
    distance = float(np.linalg.norm(target))
    if not abs(UPPER - LOWER) < distance < UPPER + LOWER:
        raise SettingsError(
            f"the arm cannot reach: its wrist would be {distance:.2f} m from its shoulder",
            expected=f"between {abs(UPPER - LOWER):.2f} and {UPPER + LOWER:.2f} m",
        )
    bend = acos((distance**2 - UPPER**2 - LOWER**2) / (2 * UPPER * LOWER))
    elbow = -bend if elbow_up else bend
    elbow_offset = atan2(LOWER * sin(elbow), UPPER + LOWER * cos(elbow))
    return atan2(target[1], target[0]) - elbow_offset, elbow


def _wrap_angle(angle: float) -> float:
    return (angle + pi) % (2 * pi) - pi


@cache
def _links() -> tuple[Solid, ...]:
    """The six links, each with its joint at the origin and x along it."""
    r = THICKNESS / 2
    shoulder = join(
        cone((0, 0, -0.25), (0, 0, FOOT), 0.30, 0.26, HOUSING),
        cone((0, -0.3, FOOT), (0, 0.3, FOOT), 0.22, None, HOUSING),
    )
    upper = _boom(UPPER, r)
    lower = _boom(LOWER, r)
    wrist = join(
        cone((0, -0.24, 0), (0, 0.24, 0), 0.21, None, HOUSING),
        cone((0, 0, 0), (WRIST, 0, 0), 0.17, None, BLANKET),
    )
    hand = join(
        cone((0, 0, -0.24), (0, 0, 0.24), 0.20, None, HOUSING),
        cone((0, 0, 0), (HAND, 0, 0), 0.17, None, BLANKET),
    )
    tool = join(
        cone((0, 0, 0), (0.5, 0, 0), r, None, HOUSING),
        cone((0.5, 0, 0), (TOOL - 0.12, 0, 0), r * 0.92, None, BLANKET),
        cone((TOOL - 0.2, 0, 0), (TOOL, 0, 0), r, None, DARK),
        box((0.34, 0.16, 0.2), (0.45, 0, r + 0.08), HOUSING),
        ball(0.07, (0.62, 0, r + 0.08), DARK),
    )
    return shoulder, upper, lower, wrist, hand, tool


def _boom(length: float, r: float) -> Solid:
    """A boom with thicker joint housings, straps and a cable duct."""
    straps = [
        cone((x, 0, 0), (x + 0.08, 0, 0), r * 1.04, None, DARK)
        for x in np.arange(1.0, length - 0.6, 0.9)
    ]
    return join(
        cone((0, -0.27, 0), (0, 0.27, 0), 0.24, None, HOUSING),
        cone((0.0, 0, 0), (0.45, 0, 0), r * 1.15, None, HOUSING),
        cone((0.3, 0, 0), (length - 0.2, 0, 0), r, None, BLANKET),
        cone((length - 0.5, 0, 0), (length, 0, 0), r * 1.12, None, HOUSING),
        *straps,
    )

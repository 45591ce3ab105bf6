"""A robot arm on a table: a turret, two links and a hand with fingers or a suction cup.

The hand points along x of its own frame; its fingers open along y. The tip is the point between the ends of
the fingers.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from visup.render.meshes.solids import Colour, Solid, ball, box, cone, join
from visup.render.worlds.motion import make_poses, static_pose
from visup.render.worlds.world import Poses, RigidBody, Surface

Doubles = NDArray[np.float64]
DARK: Colour = (0.16, 0.16, 0.18)


@dataclass(frozen=True, slots=True)
class RobotDesign:
    """The design of an arm, metres.

    Attributes:
        base: (x, y) of its base on the table.
        height: Height of its shoulder.
        upper_length: Length of the first link.
        lower_length: Length of the second link.
        hand_length: Distance from the wrist to the tip.
        link_radius: Radius of the links.
        colour: Colour of the links.
        joint_colour: Colour of joints and base.
        round_links: Whether links are round; else they are boxes.
        has_fingers: Whether it has fingers; else it has a suction cup.
        finger_length: Length of a finger.
        surface: Texture of the whole arm.
    """

    base: tuple[float, float]
    height: float
    upper_length: float
    lower_length: float
    hand_length: float
    link_radius: float
    colour: Colour
    joint_colour: Colour
    round_links: bool
    has_fingers: bool
    finger_length: float
    surface: Surface


def random_robot(rng: np.random.Generator, base: tuple[float, float], reach: float) -> RobotDesign:
    """An arm with a given reach, metres from its foot."""
    upper = reach * rng.uniform(0.58, 0.68)
    colours: tuple[Colour, ...] = (
        (0.85, 0.45, 0.08),
        (0.85, 0.85, 0.83),
        (0.15, 0.35, 0.7),
        (0.82, 0.7, 0.1),
        (0.2, 0.2, 0.22),
        (0.7, 0.12, 0.1),
        (0.35, 0.55, 0.4),
    )
    joints: tuple[Colour, ...] = (
        (0.25, 0.25, 0.28),
        (0.5, 0.5, 0.53),
        (0.1, 0.1, 0.12),
        (0.7, 0.7, 0.72),
    )
    return RobotDesign(
        base,
        float(rng.uniform(0.22, 0.34)),
        float(upper),
        float(reach * rng.uniform(0.58, 0.66)),
        float(rng.uniform(0.15, 0.2)),
        float(rng.uniform(0.024, 0.042)),
        colours[rng.integers(len(colours))],
        joints[rng.integers(len(joints))],
        bool(rng.random() < 0.6),
        bool(rng.random() < 0.8),
        float(rng.uniform(0.06, 0.09)),
        Surface("grain", 0.1, 0.08, int(rng.integers(1 << 30))),
    )


@dataclass(frozen=True, slots=True, eq=False)
class TipTrajectory:
    """Motion of an arm's tip.

    Attributes:
        tip: (F, 3) world, metres.
        opening: (F,) distance between the fingers, metres.
        roll: (F,) rotation of the hand about its own axis, radians.
        tilt: (F,) radians by which the hand points outwards, 0 for straight down.
    """

    tip: Doubles
    opening: Doubles
    roll: Doubles
    tilt: Doubles


def hand_poses(design: RobotDesign, trajectory: TipTrajectory) -> Poses:
    """(F, 4, 4) poses of the hand, its origin in the wrist."""
    yaw, wrist = _wrist(design, trajectory)
    return make_poses(wrist, yaw, np.pi / 2 - trajectory.tilt, trajectory.roll)


def robot_bodies(
    design: RobotDesign, trajectory: TipTrajectory, name: str, label: int, arm_label: int
) -> list[RigidBody]:
    """The arm as bodies: a static base, links, hand and fingers.

    Args:
        design: Its design.
        trajectory: Motion of its tip.
        name: Name of the hand, and of the links if they have the same label.
        label: Label of the hand in masks.
        arm_label: Label of the links; the hand's label makes the whole arm one object.
    """
    yaw, wrist = _wrist(design, trajectory)
    shoulder = np.array([*design.base, design.height])
    horizontal = np.linalg.norm(wrist[:, :2] - shoulder[:2], axis=1)
    vertical = wrist[:, 2] - shoulder[2]
    reach = np.clip(
        np.hypot(horizontal, vertical), 0, (design.upper_length + design.lower_length) * 0.9999
    )
    bend = np.arccos(
        np.clip(
            (design.upper_length**2 + reach**2 - design.lower_length**2)
            / (2 * design.upper_length * reach),
            -1,
            1,
        )
    )
    first = np.arctan2(vertical, horizontal) + bend
    elbow_horizontal, elbow_vertical = (
        design.upper_length * np.cos(first),
        design.upper_length * np.sin(first),
    )
    second = np.arctan2(vertical - elbow_vertical, horizontal - elbow_horizontal)
    out = np.column_stack([np.cos(yaw), np.sin(yaw)])
    elbow = np.column_stack(
        [shoulder[:2] + out * elbow_horizontal[:, None], shoulder[2] + elbow_vertical]
    )
    arm = name if arm_label == label else f"{name}_arm"
    surface = design.surface

    def part(part_name: str, solid: Solid, poses: Poses, part_label: int) -> RigidBody:
        return RigidBody(part_name, solid, poses, part_label, surface)

    links = [
        part("robot_base", _base(design), static_pose(*design.base), 0),
        part(arm, _turret(design), make_poses(shoulder, yaw), arm_label),
        part(
            arm,
            _link(design, design.upper_length, 1.15),
            make_poses(np.tile(shoulder, (len(yaw), 1)), yaw, -first),
            arm_label,
        ),
        part(
            arm, _link(design, design.lower_length, 0.9), make_poses(elbow, yaw, -second), arm_label
        ),
    ]
    hand = hand_poses(design, trajectory)
    return [*links, *_hand_bodies(design, trajectory, hand, name, label)]


def _wrist(design: RobotDesign, trajectory: TipTrajectory) -> tuple[Doubles, Doubles]:
    """(F,) yaw of the arm and (F, 3) position of its wrist."""
    yaw = np.unwrap(
        np.arctan2(trajectory.tip[:, 1] - design.base[1], trajectory.tip[:, 0] - design.base[0])
    )
    out = np.column_stack([np.cos(yaw), np.sin(yaw), np.zeros(len(yaw))])
    tilt = trajectory.tilt[:, None]
    direction = np.sin(tilt) * out + np.cos(tilt) * np.array([0.0, 0.0, -1.0])
    return yaw, trajectory.tip - design.hand_length * direction


def _hand_bodies(
    design: RobotDesign, trajectory: TipTrajectory, hand: Poses, name: str, label: int
) -> list[RigidBody]:
    palm = RigidBody(name, _palm(design), hand, label, design.surface)
    if not design.has_fingers:
        return [palm]
    found = [palm]
    for side in (-1, 1):
        shift = np.tile(np.eye(4), (len(hand), 1, 1))
        shift[:, 1, 3] = side * (trajectory.opening / 2 + 0.006)
        found.append(RigidBody(name, _finger(design), hand @ shift, label, design.surface))
    return found


def _base(design: RobotDesign) -> Solid:
    r = design.link_radius * 1.9
    return join(
        cone((0, 0, 0), (0, 0, 0.02), r * 1.4, None, design.joint_colour),
        cone((0, 0, 0.02), (0, 0, design.height - 0.06), r, r * 0.85, design.joint_colour),
    )


def _turret(design: RobotDesign) -> Solid:
    r = design.link_radius
    return join(
        cone((0, 0, -0.07), (0, 0, -0.01), r * 1.6, None, design.colour),
        cone((0, -r * 1.5, 0), (0, r * 1.5, 0), r * 1.3, None, design.joint_colour),
    )


def _link(design: RobotDesign, length: float, radius_scale: float) -> Solid:
    r = design.link_radius * radius_scale
    if design.round_links:
        boom = cone((0, 0, 0), (length, 0, 0), r, r * 0.8, design.colour)
    else:
        boom = box((length, 1.7 * r, 1.7 * r), (length / 2, 0, 0), design.colour)
    return join(boom, ball(r * 1.25, (length, 0, 0), design.joint_colour, 2))


def _palm(design: RobotDesign) -> Solid:
    r, end = design.link_radius, design.hand_length
    start = end - (design.finger_length if design.has_fingers else 0.03)
    wrist = cone((0, 0, 0), (start - 0.02, 0, 0), r * 0.8, r * 0.7, design.colour)
    if design.has_fingers:
        return join(wrist, box((0.035, 0.13, 0.05), (start - 0.01, 0, 0), design.joint_colour))
    return join(wrist, cone((start - 0.02, 0, 0), (end, 0, 0), r * 0.4, r * 0.9, DARK))


def _finger(design: RobotDesign) -> Solid:
    length = design.finger_length + 0.005
    return box((length, 0.012, 0.026), (design.hand_length - length / 2 + 0.005, 0, 0), DARK)

"""A robot arm on a table: a turret, two links and a hand with fingers or a suction cup.

The hand points along x of its own frame; its fingers open along y. The tip is the point between the ends of
the fingers.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from visup.render.meshes.solids import Colour, Solid, ball, box, cone, join
from visup.render.worlds.motion import posed, still
from visup.render.worlds.world import Poses, Surface, Thing

Doubles = NDArray[np.float64]
DARK: Colour = (0.16, 0.16, 0.18)


@dataclass(frozen=True, slots=True)
class RobotDesign:
    """The design of an arm, metres.

    Attributes:
        foot: (x, y) of its base on the table.
        height: Height of its shoulder.
        upper: Length of the first link.
        lower: Length of the second link.
        hand: Distance from the wrist to the tip.
        thick: Radius of the links.
        colour: Colour of the links.
        joint: Colour of joints and base.
        round: Whether links are round; else they are boxes.
        fingers: Whether it has fingers; else it has a suction cup.
        finger: Length of a finger.
        surface: Texture of the whole arm.
    """

    foot: tuple[float, float]
    height: float
    upper: float
    lower: float
    hand: float
    thick: float
    colour: Colour
    joint: Colour
    round: bool
    fingers: bool
    finger: float
    surface: Surface


def random_robot(rng: np.random.Generator, foot: tuple[float, float], reach: float) -> RobotDesign:
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
        foot,
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
class RobotCourse:
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


def hand_poses(design: RobotDesign, course: RobotCourse) -> Poses:
    """(F, 4, 4) poses of the hand, its origin in the wrist."""
    yaw, wrist = _wrist(design, course)
    return posed(wrist, yaw, np.pi / 2 - course.tilt, course.roll)


def robot_things(
    design: RobotDesign, course: RobotCourse, name: str, label: int, arm_label: int
) -> list[Thing]:
    """The arm as things: a static base, links, hand and fingers.

    Args:
        design: Its design.
        course: Motion of its tip.
        name: Name of the hand, and of the links if they have the same label.
        label: Label of the hand in masks.
        arm_label: Label of the links; the hand's label makes the whole arm one object.
    """
    yaw, wrist = _wrist(design, course)
    foot = np.array([*design.foot, design.height])
    flat = np.linalg.norm(wrist[:, :2] - foot[:2], axis=1)
    high = wrist[:, 2] - foot[2]
    far = np.clip(np.hypot(flat, high), 0, (design.upper + design.lower) * 0.9999)
    bend = np.arccos(
        np.clip((design.upper**2 + far**2 - design.lower**2) / (2 * design.upper * far), -1, 1)
    )
    first = np.arctan2(high, flat) + bend
    elbow_flat, elbow_high = design.upper * np.cos(first), design.upper * np.sin(first)
    second = np.arctan2(high - elbow_high, flat - elbow_flat)
    out = np.column_stack([np.cos(yaw), np.sin(yaw)])
    elbow = np.column_stack([foot[:2] + out * elbow_flat[:, None], foot[2] + elbow_high])
    arm = name if arm_label == label else f"{name}_arm"
    surface = design.surface

    def part(who: str, solid: Solid, poses: Poses, mark: int) -> Thing:
        return Thing(who, solid, poses, mark, surface)

    links = [
        part("robot_base", _base(design), still(*design.foot), 0),
        part(arm, _turret(design), posed(foot, yaw), arm_label),
        part(
            arm,
            _link(design, design.upper, 1.15),
            posed(np.tile(foot, (len(yaw), 1)), yaw, -first),
            arm_label,
        ),
        part(arm, _link(design, design.lower, 0.9), posed(elbow, yaw, -second), arm_label),
    ]
    hand = hand_poses(design, course)
    return [*links, *_hand_things(design, course, hand, name, label)]


def _wrist(design: RobotDesign, course: RobotCourse) -> tuple[Doubles, Doubles]:
    """(F,) yaw of the arm and (F, 3) position of its wrist."""
    yaw = np.unwrap(
        np.arctan2(course.tip[:, 1] - design.foot[1], course.tip[:, 0] - design.foot[0])
    )
    out = np.column_stack([np.cos(yaw), np.sin(yaw), np.zeros(len(yaw))])
    lean = course.tilt[:, None]
    way = np.sin(lean) * out + np.cos(lean) * np.array([0.0, 0.0, -1.0])
    return yaw, course.tip - design.hand * way


def _hand_things(
    design: RobotDesign, course: RobotCourse, hand: Poses, name: str, label: int
) -> list[Thing]:
    palm = Thing(name, _palm(design), hand, label, design.surface)
    if not design.fingers:
        return [palm]
    found = [palm]
    for side in (-1, 1):
        shift = np.tile(np.eye(4), (len(hand), 1, 1))
        shift[:, 1, 3] = side * (course.opening / 2 + 0.006)
        found.append(Thing(name, _finger(design), hand @ shift, label, design.surface))
    return found


def _base(design: RobotDesign) -> Solid:
    r = design.thick * 1.9
    return join(
        cone((0, 0, 0), (0, 0, 0.02), r * 1.4, None, design.joint),
        cone((0, 0, 0.02), (0, 0, design.height - 0.06), r, r * 0.85, design.joint),
    )


def _turret(design: RobotDesign) -> Solid:
    r = design.thick
    return join(
        cone((0, 0, -0.07), (0, 0, -0.01), r * 1.6, None, design.colour),
        cone((0, -r * 1.5, 0), (0, r * 1.5, 0), r * 1.3, None, design.joint),
    )


def _link(design: RobotDesign, length: float, thick: float) -> Solid:
    r = design.thick * thick
    if design.round:
        boom = cone((0, 0, 0), (length, 0, 0), r, r * 0.8, design.colour)
    else:
        boom = box((length, 1.7 * r, 1.7 * r), (length / 2, 0, 0), design.colour)
    return join(boom, ball(r * 1.25, (length, 0, 0), design.joint, 2))


def _palm(design: RobotDesign) -> Solid:
    r, end = design.thick, design.hand
    start = end - (design.finger if design.fingers else 0.03)
    wrist = cone((0, 0, 0), (start - 0.02, 0, 0), r * 0.8, r * 0.7, design.colour)
    if design.fingers:
        return join(wrist, box((0.035, 0.13, 0.05), (start - 0.01, 0, 0), design.joint))
    return join(wrist, cone((start - 0.02, 0, 0), (end, 0, 0), r * 0.4, r * 0.9, DARK))


def _finger(design: RobotDesign) -> Solid:
    long = design.finger + 0.005
    return box((long, 0.012, 0.026), (design.hand - long / 2 + 0.005, 0, 0), DARK)

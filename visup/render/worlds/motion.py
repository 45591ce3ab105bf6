"""Motion over time: keyframes with smooth start and stop, falling, following."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from visup.render.worlds.world import FPS, Poses

Doubles = NDArray[np.float64]
GRAVITY = 9.81


def frame_times(frames: int) -> Doubles:
    """(F,) times of the frames, seconds."""
    return np.arange(frames) / FPS


def eased(at: Doubles, keys: Sequence[tuple[float, Any]]) -> Doubles:
    """Values between keyframes with zero speed at each (minimum jerk); constant outside.

    Args:
        at: (F,) seconds.
        keys: (seconds, value) with rising times; values are numbers or (D,).

    Returns:
        (F,) or (F, D).
    """
    times = np.array([t for t, _ in keys], float)
    values = np.array([v for _, v in keys], float)
    if len(keys) == 1:
        return np.repeat(values, len(at), axis=0)
    k = np.clip(np.searchsorted(times, at, side="right") - 1, 0, len(keys) - 2)
    share = np.clip((at - times[k]) / (times[k + 1] - times[k]), 0, 1)
    soft = share**3 * (10 - 15 * share + 6 * share**2)
    if values.ndim > 1:
        soft = soft[:, None]
    return np.asarray(values[k] + soft * (values[k + 1] - values[k]))


def trapezoidal_profile(at: Doubles, begin: float, end: float, ramp: float = 0.2) -> Doubles:
    """(F,) shares of a path, 0 to 1: acceleration, constant speed, deceleration.

    `ramp` is the share of the time for each of acceleration and deceleration.
    """
    u = np.clip((at - begin) / (end - begin), 0, 1)
    speed = 1 / (1 - ramp)
    up, down = speed * u**2 / (2 * ramp), 1 - speed * (1 - u) ** 2 / (2 * ramp)
    return np.where(u < ramp, up, np.where(u > 1 - ramp, down, speed * (u - ramp / 2)))


def make_poses(
    positions: ArrayLike, yaw: ArrayLike = 0.0, pitch: ArrayLike = 0.0, roll: ArrayLike = 0.0
) -> Poses:
    """Poses from positions and angles.

    Args:
        positions: (F, 3) or (3,).
        yaw: Radians about z; a number or (F,), as the others.
        pitch: Radians about the rotated y; positive lowers the front.
        roll: Radians about the rotated x.

    Returns:
        (F, 4, 4); (1, 4, 4) if every argument is constant.
    """
    xyz = np.atleast_2d(np.asarray(positions, float))
    given = [np.atleast_1d(np.asarray(a, float)) for a in (yaw, pitch, roll)]
    count = max(len(xyz), *(len(a) for a in given))
    angles = np.column_stack([np.broadcast_to(a, count) for a in given])
    poses = np.tile(np.eye(4), (count, 1, 1))
    poses[:, :3, :3] = Rotation.from_euler("ZYX", angles).as_matrix()
    poses[:, :3, 3] = xyz
    return poses


def static_pose(x: float, y: float, z: float = 0.0, yaw: float = 0.0) -> Poses:
    """(1, 4, 4): a body that never moves."""
    return make_poses([x, y, z], yaw)


def path_positions(points: Doubles, share: Doubles) -> tuple[Doubles, Doubles]:
    """Positions and headings on a polyline.

    Args:
        points: (K, 2) or (K, 3) corners of a fine polyline.
        share: (F,) of its length, 0 to 1.

    Returns:
        (F, D) positions and (F,) headings in the plane, radians.
    """
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    length = np.concatenate([[0], np.cumsum(steps)])
    s = np.clip(share, 0, 1) * length[-1]
    at = np.column_stack([np.interp(s, length, points[:, d]) for d in range(points.shape[1])])
    heading = np.unwrap(np.arctan2(np.diff(points[:, 1]), np.diff(points[:, 0])))
    middle = (length[1:] + length[:-1]) / 2
    return at, np.interp(s, middle, heading)


def quadratic_bezier(
    start: ArrayLike, through: ArrayLike, end: ArrayLike, count: int = 60
) -> Doubles:
    """(count, D): a quadratic curve from a start to an end, drawn towards a point between."""
    a, b, c = (np.asarray(p, float) for p in (start, through, end))
    u = np.linspace(0, 1, count)[:, None]
    return np.asarray((1 - u) ** 2 * a + 2 * u * (1 - u) * b + u**2 * c)


def carried(rest: Poses, carrier: Poses, grasp: int, release: int) -> Poses:
    """What lies still, moves with a carrier as one body, and stays where it is let go.

    Args:
        rest: (4, 4), its pose at the start.
        carrier: (F, 4, 4).
        grasp: First frame in which it moves with the carrier.
        release: First frame in which it no longer does.

    Returns:
        (F, 4, 4).
    """
    poses = np.tile(rest, (len(carrier), 1, 1))
    held = np.linalg.inv(carrier[grasp]) @ rest
    release = min(release, len(carrier))
    poses[grasp:release] = carrier[grasp:release] @ held
    poses[release:] = poses[release - 1]
    return poses


def dropped(
    poses: Poses, since: int, floor: float, tumble: ArrayLike = (0.0, 0.0, 0.0), scale: float = 1.0
) -> tuple[Poses, int]:
    """Poses with a fall from a frame on, and a small bounce.

    Args:
        poses: (F, 4, 4) without the fall.
        since: First frame of the fall.
        floor: Final height of the body's origin.
        tumble: Rotation during the fall, radians (world axes).
        scale: Factor on gravity, for scenes that are not in metres.

    Returns:
        (F, 4, 4), and the frame in which it hits the floor.
    """
    out = poses.copy()
    speed = (poses[since, :3, 3] - poses[since - 1, :3, 3]) * FPS
    place, start = poses[since, :3, 3].copy(), poses[since, :3, :3]
    t = np.arange(len(poses) - since) / FPS
    g = GRAVITY * scale
    height = place[2] - floor
    impact = (speed[2] + np.sqrt(max(speed[2] ** 2 + 2 * g * height, 0))) / g
    impact = max(impact, 1e-3)
    z = np.where(t < impact, height + speed[2] * t - g * t**2 / 2, 0)
    bounce = np.clip(t - impact, 0, None)
    up = 0.25 * g * impact
    z = np.where(t >= impact, np.clip(up * bounce - g * bounce**2 / 2, 0, None), z)
    slide = np.minimum(t, impact) + 0.15 * (1 - np.exp(-np.clip(t - impact, 0, None) / 0.15))
    out[since:, :2, 3] = place[:2] + speed[:2] * slide[:, None]
    out[since:, 2, 3] = floor + z
    turned = np.clip(t / impact, 0, 1)[:, None] * np.asarray(tumble, float)
    out[since:, :3, :3] = Rotation.from_rotvec(turned).as_matrix() @ start
    return out, since + int(np.ceil(impact * FPS))


def frame_at(seconds: float) -> int:
    """The frame nearest to a time."""
    return round(seconds * FPS)

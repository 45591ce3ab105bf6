"""Motion over time: poses between keyframes, spin, and the shake of a camera.

A pose is a (4, 4) float64 rigid motion from an object's own frame to the world's.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import PchipInterpolator
from scipy.spatial.transform import Rotation, Slerp

Matrix = NDArray[np.float64]


def pose_of(position: NDArray[np.float64], rotation: Rotation) -> Matrix:
    """The (4, 4) pose with a rotation and a position."""
    pose = np.eye(4)
    pose[:3, :3] = rotation.as_matrix()
    pose[:3, 3] = position
    return pose


def inverse(pose: Matrix) -> Matrix:
    """The rigid motion that undoes a pose."""
    out = np.eye(4)
    out[:3, :3] = pose[:3, :3].T
    out[:3, 3] = -pose[:3, :3].T @ pose[:3, 3]
    return out


def look_at(position: ArrayLike, target: ArrayLike, up: ArrayLike) -> Rotation:
    """The rotation of a camera (x right, y down, z forward) that looks at a point.

    Args:
        position: (3,) of the camera, world.
        target: (3,) point for the centre of the image.
        up: (3,) direction that points up in the image; not along the line of sight.

    Returns:
        Camera to world.
    """
    z = np.asarray(target, float) - np.asarray(position, float)
    z /= np.linalg.norm(z)
    x = np.cross(z, np.asarray(up, float))
    x /= np.linalg.norm(x)
    return Rotation.from_matrix(np.stack([x, np.cross(z, x), z], axis=1))


def value_at(
    times: NDArray[np.float64], values: NDArray[np.float64], t: float, smooth: bool
) -> NDArray[np.float64]:
    """A vector between keyframes, constant outside them.

    Args:
        times: (N,) seconds, rising.
        values: (N, D).
        t: Seconds.
        smooth: Monotone cubic instead of linear interpolation.

    Returns:
        (D,).
    """
    at = float(np.clip(t, times[0], times[-1]))
    if len(times) == 1:
        return np.asarray(values[0], float)
    if smooth:
        return np.asarray(PchipInterpolator(times, values, axis=0)(at), float)
    return np.array([np.interp(at, times, column) for column in values.T])


def rotation_at(times: NDArray[np.float64], rotations: Rotation, t: float) -> Rotation:
    """An orientation between keyframes, turning at a constant rate (slerp)."""
    if len(times) == 1:
        return rotations[0]
    return Slerp(times, rotations)(float(np.clip(t, times[0], times[-1])))


def rotation_about(axis: NDArray[np.float64], degrees: float) -> Rotation:
    """A rotation about an axis of any length."""
    return Rotation.from_rotvec(np.radians(degrees) * axis / np.linalg.norm(axis))


def camera_shake(t: float, amplitude_deg: float, frequency_hz: float, seed: int) -> Rotation:
    """A small camera rotation that varies without repeating.

    Args:
        t: Seconds.
        amplitude_deg: Standard deviation about each axis, roughly.
        frequency_hz: The lowest of three frequencies that are summed for each axis.
        seed: Chooses their phases.

    Returns:
        The rotation, in the camera's frame.
    """
    phases = np.random.default_rng(seed).uniform(0, 2 * np.pi, (3, 3))
    rates = 2 * np.pi * frequency_hz * np.array([1.0, 1.73, 2.91])
    waves = np.sin(rates * t + phases) * np.array([0.8, 0.5, 0.3])
    return Rotation.from_rotvec(np.radians(amplitude_deg) * waves.sum(axis=1))

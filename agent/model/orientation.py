"""How an object that is seen from a direction stands before the camera: the one place of this convention.

A *direction* is the unit vector from the object to the viewer, in the model's frame. A picture taken from
there has the model's +z up (looking along z, its +y). A *rotation* turns the picture in its plane, in
radians from x (right) towards y (down). Both together are an *orientation*: the (3, 3) matrix that takes
vectors of the model's frame to the camera's (x right, y down, z forward).

A mirrored match needs no rule of its own: it tells of the opposite direction, whose picture, with this
roll, is the mirror image left to right.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

_ALONG_POLE = 0.999


def image_axes(direction: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Right and up of the picture seen from directions.

    Args:
        direction: (..., 3) unit vectors from the object to the viewer, model frame.

    Returns:
        Two arrays (..., 3) float64 of unit vectors, model frame.

    Example:
        >>> right, up = image_axes([0.0, -1.0, 0.0])
        >>> right.astype(int).tolist(), up.astype(int).tolist()
        ([1, 0, 0], [0, 0, 1])
    """
    d = np.asarray(direction, np.float64)
    x, y, z = d[..., 0], d[..., 1], d[..., 2]
    upright, none = np.abs(z) < _ALONG_POLE, np.zeros_like(x)
    # pole x direction, the pole being +z or, looking along it, +y.
    right = np.stack([np.where(upright, -y, z), np.where(upright, x, none), -x * ~upright], -1)
    right /= np.sqrt((right**2).sum(axis=-1, keepdims=True))
    return right, _cross(d, right)


def orientations(directions: ArrayLike, rotations: ArrayLike) -> NDArray[np.float64]:
    """Orientations of an object that is seen from directions, turned in the plane.

    Args:
        directions: (..., 3) unit vectors from the object to the viewer, model frame.
        rotations: (...) radians from x towards y that take the picture to what is seen.

    Returns:
        (..., 3, 3) float64 rotation matrices, model to camera.

    Example:
        From -y, unturned, the model's x is right, its z up and its y away from the viewer.

        >>> orientations([0.0, -1.0, 0.0], 0.0).round().astype(int).tolist()
        [[1, 0, 0], [0, 0, -1], [0, 1, 0]]
    """
    d = np.asarray(directions, np.float64)
    right, up = image_axes(d)
    angle = np.asarray(rotations, np.float64)[..., None]
    c, s = np.cos(angle), np.sin(angle)
    return np.stack([c * right + s * up, s * right - c * up, -d], axis=-2)


def views(orientation: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The inverse of `orientations`.

    Args:
        orientation: (..., 3, 3) rotation matrices, model to camera.

    Returns:
        (..., 3) directions and (...) rotations in (-pi, pi], float64.
    """
    m = np.asarray(orientation, np.float64)
    directions = -m[..., 2, :]
    right, up = image_axes(directions)
    x = m[..., 0, :]
    return directions, np.arctan2((x * up).sum(axis=-1), (x * right).sum(axis=-1))


def swing_and_roll(
    one: ArrayLike, other: ArrayLike
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """How far apart orientations are: the angle between their directions, and the turn in the plane.

    Args:
        one: (..., 3, 3) rotation matrices, model to camera.
        other: The same.

    Returns:
        (...) swing, in [0, pi], and (...) roll, in (-pi, pi], that takes `one` to `other` once the
        direction of the one has been swung the shortest way to that of the other; radians, float64.

    Example:
        >>> turned = orientations([[0.0, -1.0, 0.0], [0.0, -1.0, 0.0], [1.0, 0.0, 0.0]], [0, 0.5, 0])
        >>> swing, roll = swing_and_roll(turned[0], turned)
        >>> swing.round(2).tolist(), abs(roll).round(2).tolist()
        ([0.0, 0.0, 1.57], [0.0, 0.5, 0.0])
    """
    m = np.asarray(other, np.float64) @ np.swapaxes(np.asarray(one, np.float64), -1, -2)
    swing = np.arccos(np.clip(m[..., 2, 2], -1.0, 1.0))
    return swing, np.arctan2(m[..., 1, 0] - m[..., 0, 1], m[..., 0, 0] + m[..., 1, 1])


def _cross(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """Cross product along the last axis; that of NumPy takes several times as long on few vectors."""
    i, j = [1, 2, 0], [2, 0, 1]
    return np.asarray(a[..., i] * b[..., j] - a[..., j] * b[..., i])

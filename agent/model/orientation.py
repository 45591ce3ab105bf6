"""The convention for orientations of objects: view direction and in-plane rotation, defined here only.

A *direction* is the unit vector from the object to the viewer, in the model's frame. The image seen from
there has the model's +z up (looking along z, its +y). A *rotation* turns the image in its plane, in radians
from x (right) towards y (down). Together they are an *orientation*: the (3, 3) matrix from the model's frame
to the camera's (x right, y down, z forward).

A mirrored match needs no special case: it means the opposite direction, whose image, with this roll, is
mirrored left to right.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

_ALONG_POLE = 0.999


def image_axes(direction: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The right and up axes of the images seen from directions.

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
    # Cross product of pole and direction; the pole is +z or, looking along it, +y.
    right = np.stack([np.where(upright, -y, z), np.where(upright, x, none), -x * ~upright], -1)
    right /= np.sqrt((right**2).sum(axis=-1, keepdims=True))
    return right, _cross(d, right)


def orientations(directions: ArrayLike, rotations: ArrayLike) -> NDArray[np.float64]:
    """Orientations of an object seen from directions and rotated in the image plane.

    Args:
        directions: (..., 3) unit vectors from the object to the viewer, model frame.
        rotations: (...) radians from x towards y, from the unrotated image to the observed one.

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
    """The difference of orientations: angle between directions, and in-plane rotation.

    Args:
        one: (..., 3, 3) rotation matrices, model to camera.
        other: The same.

    Returns:
        (...) swing in [0, pi] and (...) roll in (-pi, pi] that takes `one` to `other` after its direction has
        been swung the shortest way to the other's; radians, float64.

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
    """Cross product along the last axis; several times faster than NumPy's on few vectors."""
    i, j = [1, 2, 0], [2, 0, 1]
    return np.asarray(a[..., i] * b[..., j] - a[..., j] * b[..., i])

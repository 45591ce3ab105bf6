"""Vectorised rotations: matrices from rotation vectors and back, and their means.

A rotation vector points along the axis; its length is the angle in radians, by the right-hand rule.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
_SMALL = 1e-9


def rotation_matrices(vectors: Floats) -> Floats:
    """Rotation matrices (..., 3, 3) of rotation vectors (..., 3), radians (Rodrigues).

    Example:
        >>> rotation_matrices(np.array([0.0, 0.0, np.pi / 2])).round().astype(int).tolist()
        [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
    """
    sine, versine, k, squared = _series(vectors)
    return np.asarray(np.eye(3) + sine * k + versine * squared)


def right_jacobian(vectors: Floats) -> Floats:
    """The right Jacobian: R(v + d) ~ R(v) R(J d) for small d, with R = `rotation_matrices`.

    Args:
        vectors: (..., 3) radians.

    Returns:
        (..., 3, 3) float64.
    """
    square = (vectors**2).sum(axis=-1)[..., None, None]
    _, versine, k, squared = _series(vectors)
    angle = np.sqrt(square)
    cubic = np.where(
        square > _SMALL, (angle - np.sin(angle)) / np.maximum(angle * square, 1e-30), 1 / 6
    )
    return np.asarray(np.eye(3) - versine * k + cubic * squared)


def rotation_vectors(matrices: Floats) -> Floats:
    """Rotation vectors (..., 3), of length at most pi, of rotation matrices (..., 3, 3).

    Example:
        >>> v = np.array([0.3, -0.2, 0.1])
        >>> bool(np.allclose(rotation_vectors(rotation_matrices(v)), v))
        True
    """
    m = matrices
    axis = np.stack(
        [m[..., 2, 1] - m[..., 1, 2], m[..., 0, 2] - m[..., 2, 0], m[..., 1, 0] - m[..., 0, 1]], -1
    )
    length = np.sqrt((axis**2).sum(axis=-1, keepdims=True))
    angle = np.arctan2(length, np.trace(m, axis1=-2, axis2=-1)[..., None] - 1)
    # At half a turn the axis is ill-defined; any will do, since such residuals are outliers.
    lost = (length < 1e-6) & (angle > 1.0)
    unit = np.where(lost, np.array([1.0, 0.0, 0.0]), axis / np.maximum(length, _SMALL))
    return np.asarray(unit * angle)


def nearest_rotations(matrices: Floats) -> Floats:
    """The rotation nearest to each of (..., 3, 3) matrices, such as weighted sums of rotations."""
    u, _, v = np.linalg.svd(matrices)
    sign = np.ones(u.shape[:-1])
    sign[..., 2] = np.sign(np.linalg.det(u @ v))
    return np.asarray((u * sign[..., None, :]) @ v)


def sight_rotation(place: tuple[float, float], focal_px: float) -> Floats:
    """The rotation from a camera looking at a point of the image to the actual camera, (3, 3).

    Orientations are given as if the camera looked at the object, and an object that moves across the
    image without rotating is seen from another side: by this rotation.

    Args:
        place: (x, y) from the centre of the image, pixels.
        focal_px: Focal length, pixels.

    Example:
        >>> ahead = sight_rotation((100.0, 0.0), 100.0) @ np.array([0.0, 0.0, 1.0])
        >>> ahead.round(3).tolist()
        [0.707, 0.0, 0.707]
    """
    x, y = place
    off = float(np.hypot(x, y))
    turn = np.arctan2(off, focal_px) / max(off, _SMALL)
    return rotation_matrices(np.array([-y * turn, x * turn, 0.0]))


def _series(vectors: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """sin(a)/a and (1 - cos(a))/a^2, each (..., 1, 1); the cross product matrix and its square."""
    k = np.zeros((*vectors.shape, 3))
    k[..., (2, 0, 1), (1, 2, 0)] = vectors
    k[..., (1, 2, 0), (2, 0, 1)] = -vectors
    angle = np.sqrt((vectors * vectors).sum(axis=-1))[..., None, None]
    half = np.sinc(angle / (2 * np.pi))
    return np.sinc(angle / np.pi), 0.5 * half * half, k, k @ k

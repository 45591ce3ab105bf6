"""Symmetries of a mesh: other directions from which its silhouette is identical.

A view direction can be determined only up to the symmetries of the object. In parallel projection the
silhouette from behind is also the mirror image of the one from the front, so that a mesh with a plane of
symmetry looks the same from -Sd (S the reflection) and from d, although no rotation maps one to the other.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

POINTS = 20_000
"""Surface points for comparison."""

MOVED_POINTS = 300
"""Surface points that are transformed."""

TOLERANCE = 0.008
"""Mean distance, as a share of the mesh's radius, below which a transformed surface is the same."""

FOLDS = (2, 3, 4, 5, 6, 8)
"""Orders of rotational symmetries to test."""

_STEP_DEG = 5.0
_GENERIC_ANGLES_DEG = (37.0, 73.0, 101.0)


def silhouette_symmetries(mesh: Any, seed: int = 0) -> NDArray[np.float64]:
    """Rotations of the view direction that preserve a mesh's silhouette.

    Tested are rotations by a half, a third, ... an eighth turn about the mesh's own and its principal axes,
    bodies of revolution about these, and reflections in planes through them; other symmetries (such as of a
    polyhedron) are not found, which can only overestimate an error of direction.

    Args:
        mesh: A ``trimesh.Trimesh``.
        seed: Random seed of the surface points.

    Returns:
        (S, 3, 3) float64 proper rotations of direction vectors, mesh frame; the identity is first.
    """
    points = _surface(mesh, seed)
    comparison = _SurfaceComparison(points)
    axes = np.vstack([np.eye(3), np.linalg.eigh(points.T @ points)[1].T])
    symmetries = [m for axis in axes for m in _symmetries_of(axis, axes, comparison)]
    # Point reflection mirrors the silhouette: with a reflection it gives a proper rotation.
    return np.stack([np.eye(3), *(m if np.linalg.det(m) > 0 else -m for m in symmetries)])


def angle_to(
    direction: NDArray[np.float64], true: NDArray[np.float64], symmetries: NDArray[np.float64]
) -> float:
    """Angle between a direction and the nearest one equivalent to the true one, degrees.

    Args:
        direction: (3,) unit vector.
        true: (3,) unit vector.
        symmetries: (S, 3, 3), see `silhouette_symmetries`.
    """
    equivalent = symmetries @ true
    return float(np.degrees(np.arccos(np.clip((equivalent @ direction).max(), -1.0, 1.0))))


def _surface(mesh: Any, seed: int) -> NDArray[np.float64]:
    """Points sampled uniformly from the surface, centred, of unit radius; (POINTS, 3)."""
    triangles = np.asarray(mesh.triangles, dtype=np.float64)
    cross = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    area = np.linalg.norm(cross, axis=1)
    rng = np.random.default_rng(seed)
    chosen = triangles[rng.choice(len(triangles), POINTS, p=area / area.sum())]
    u, v = np.sqrt(rng.random((POINTS, 1))), rng.random((POINTS, 1))
    points = (1 - u) * chosen[:, 0] + u * (1 - v) * chosen[:, 1] + u * v * chosen[:, 2]
    points = points - points.mean(axis=0)
    return np.asarray(points / np.linalg.norm(points, axis=1).max())


class _SurfaceComparison:
    """Tests whether a surface is invariant under a transformation."""

    def __init__(self, points: NDArray[np.float64]) -> None:
        self._tree = cKDTree(points)
        self._sample = points[:: POINTS // MOVED_POINTS]
        # Sampling distance of the points: the least distance even for a perfect symmetry.
        self._spacing = float(self._tree.query(self._sample, k=2)[0][:, 1].mean())

    def distance(self, move: NDArray[np.float64]) -> float:
        """Mean distance of the transformed surface from itself."""
        distances, _ = self._tree.query(self._sample @ move.T)
        return float(distances.mean()) - self._spacing

    def is_symmetry(self, move: NDArray[np.float64]) -> bool:
        return self.distance(move) < TOLERANCE


def _symmetries_of(
    axis: NDArray[np.float64], axes: NDArray[np.float64], comparison: _SurfaceComparison
) -> list[NDArray[np.float64]]:
    """Rotations about an axis, and reflections in planes through it or perpendicular to it."""
    is_revolution = all(comparison.is_symmetry(_rotation(axis, d)) for d in _GENERIC_ANGLES_DEG)
    axial_mirror = [_mirror(axis)] if comparison.is_symmetry(_mirror(axis)) else []
    mirrors = [_mirror(n) for n in _normals(axis, axes)]
    if is_revolution:
        rotations = [_rotation(axis, d) for d in np.arange(_STEP_DEG, 360.0, _STEP_DEG)]
        return [*rotations, *axial_mirror, *mirrors]
    rotations = [m for m in _fold_rotations(axis) if comparison.is_symmetry(m)]
    distances = np.array([comparison.distance(m) for m in mirrors])
    # Planes next to a plane of symmetry are almost as good: only local minima count.
    is_minimum = (distances <= np.roll(distances, 1)) & (distances <= np.roll(distances, -1))
    return [
        *rotations,
        *axial_mirror,
        *(mirrors[k] for k in np.flatnonzero(is_minimum & (distances < TOLERANCE))),
    ]


def _fold_rotations(axis: NDArray[np.float64]) -> list[NDArray[np.float64]]:
    degrees = {360.0 * k / fold for fold in FOLDS for k in range(1, fold)}
    return [_rotation(axis, d) for d in sorted(degrees)]


def _rotation(axis: NDArray[np.float64], degrees: float) -> NDArray[np.float64]:
    return np.asarray(Rotation.from_rotvec(axis * np.radians(degrees)).as_matrix())


def _mirror(normal: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(np.eye(3) - 2 * np.outer(normal, normal))


def _normals(axis: NDArray[np.float64], axes: NDArray[np.float64]) -> list[NDArray[np.float64]]:
    """Normals of planes through an axis in steps of 5 degrees, one of them a further axis."""
    others = axes - np.outer(axes @ axis, axis)
    side = others[int(np.argmax(np.linalg.norm(others, axis=1)))]
    side = side / np.linalg.norm(side)
    angles = np.radians(np.arange(0.0, 180.0, _STEP_DEG))
    return [np.asarray(Rotation.from_rotvec(axis * t).apply(side)) for t in angles]

"""Mesh models for rendering at run time: few triangles, in a unit sphere."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from visup.agent.model.errors import DatabaseError

MAX_FACES = 2500
"""Meshes with more triangles are simplified, which is invisible at the size at which poses are fitted."""

_CELLS = 40


@dataclass(frozen=True, slots=True, eq=False)
class MeshModel:
    """A mesh for pose fitting.

    Attributes:
        name: Of the model.
        vertices: (V, 3) float32, in units of `radius` about the centre of the mesh's box, mesh axes.
        faces: (F, 3) int32, numbers of vertices.
        radius: Distance of the farthest vertex from that centre, mesh units (metres where those are).
        normals: (F, 3) float64 unit normals; their sign is not relied on.
    """

    name: str
    vertices: NDArray[np.float32]
    faces: NDArray[np.int32]
    radius: float
    normals: NDArray[np.float64] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        a, b, c = (self.vertices[self.faces[:, k]].astype(np.float64) for k in range(3))
        normals = np.cross(b - a, c - a)
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
        object.__setattr__(self, "normals", normals)


def mesh_model(name: str, vertices: NDArray[np.floating], faces: NDArray[np.integer]) -> MeshModel:
    """Make the model of a mesh.

    Args:
        name: Of the model.
        vertices: (V, 3), mesh units.
        faces: (F, 3), numbers of vertices.

    Returns:
        The mesh in its unit sphere; beyond `MAX_FACES` triangles, vertices within a cell of a coarse
        grid are merged, which moves a surface by at most a fortieth of the diameter.
    """
    points = np.asarray(vertices, dtype=np.float64)
    centre = 0.5 * (points.min(axis=0) + points.max(axis=0))
    radius = float(np.linalg.norm(points - centre, axis=1).max())
    unit, triangles = (points - centre) / radius, np.asarray(faces, dtype=np.int32)
    if len(triangles) > MAX_FACES:
        unit, triangles = _clustered(unit, triangles)
    return MeshModel(name, unit.astype(np.float32), np.ascontiguousarray(triangles), radius)


def _clustered(
    points: NDArray[np.float64], faces: NDArray[np.int32]
) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    cells = np.floor((points + 1.0) / 2.0 * _CELLS).astype(np.int64)
    _, cell = np.unique(cells, axis=0, return_inverse=True)
    cell = cell.ravel()
    counts = np.bincount(cell)
    merged = np.stack([np.bincount(cell, points[:, k]) / counts for k in range(3)], axis=1)
    clustered_faces = cell[faces].astype(np.int32)
    a, b, c = clustered_faces.T
    not_degenerate = clustered_faces[(a != b) & (b != c) & (c != a)]
    _, first = np.unique(np.sort(not_degenerate, axis=1), axis=0, return_index=True)
    return merged, not_degenerate[np.sort(first)]


def mesh_bytes(model: MeshModel) -> tuple[bytes, bytes]:
    """Vertices and faces in stored form: little-endian, row by row."""
    return model.vertices.astype("<f4").tobytes(), model.faces.astype("<i4").tobytes()


def stored_mesh(name: str, radius: float, vertices: bytes, faces: bytes) -> MeshModel:
    """The inverse of `mesh_bytes`.

    Raises:
        DatabaseError: The bytes are not a mesh.
    """
    if len(vertices) % 12 or len(faces) % 12 or not vertices or not faces or not radius > 0.0:
        raise DatabaseError(f"the mesh of '{name}' is damaged")
    points = np.frombuffer(vertices, "<f4").reshape(-1, 3)
    triangles = np.frombuffer(faces, "<i4").reshape(-1, 3)
    if triangles.min() < 0 or triangles.max() >= len(points) or not np.isfinite(points).all():
        raise DatabaseError(f"the mesh of '{name}' is damaged")
    return MeshModel(name, points.astype(np.float32), triangles.astype(np.int32), float(radius))

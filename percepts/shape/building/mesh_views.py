"""Views: silhouettes of a mesh from directions spread evenly over the sphere.

Conventions: a direction is the unit vector from the object to the viewer, in the mesh's own frame. The
projection is parallel. Roll: as in `agent/model/orientation.py`.
Needs the extra ``visup[render]``.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from visup.agent.model.errors import DatabaseError, ExtraMissingError
from visup.agent.model.orientation import image_axes

IMAGE_SIDE = 200
"""Pixels along the longer side of a rendered silhouette."""

_MAX_SPREAD = 400
_STEPS = 60


@dataclass(frozen=True, slots=True, eq=False)
class RenderedView:
    """A silhouette of a mesh.

    Attributes:
        direction: (3,) unit vector from the object to the viewer, mesh frame.
        mask: (H, W) bool, background all around.
        pixel: Side of a pixel in mesh units.
    """

    direction: NDArray[np.float64]
    mask: NDArray[np.bool_]
    pixel: float

    @property
    def area(self) -> float:
        """Area of the silhouette, mesh units squared."""
        return float(np.count_nonzero(self.mask)) * self.pixel**2


def sphere_directions(count: int, seed: int = 0) -> NDArray[np.float64]:
    """Directions spread evenly over the sphere: a Fibonacci lattice, randomly rotated.

    Args:
        count: How many, at least 1.
        seed: Seed of the rotation; 0 for none.

    Returns:
        (count, 3) float64 unit vectors.

    Example:
        >>> d = sphere_directions(32)
        >>> d.shape, bool(np.allclose(np.linalg.norm(d, axis=1), 1)), float(abs(d.mean(0)).max()) < 0.05
        ((32, 3), True, True)
    """
    k = np.arange(count) + 0.5
    z = 1 - 2 * k / count
    angle = np.pi * (1 + 5**0.5) * k
    flat = np.sqrt(1 - z**2)
    lattice = np.stack([flat * np.cos(angle), flat * np.sin(angle), z], axis=1)
    return lattice if seed == 0 else np.asarray(lattice @ _random_rotation(seed).T)


def half_sphere_directions(count: int, seed: int = 0) -> NDArray[np.float64]:
    """Directions that, together with their opposites, are spread evenly over the sphere.

    In parallel projection the silhouette from behind is the mirror image of the one from the front, and a
    mirrored match indicates the opposite direction: half of the sphere suffices, and the same number of
    views covers it twice as densely.

    Args:
        count: How many, at least 1.
        seed: Seed of the rotation; 0 for none.

    Returns:
        (count, 3) float64 unit vectors.

    Example:
        >>> d = half_sphere_directions(32)
        >>> np.degrees(np.arccos(np.abs(d @ d.T - np.eye(32)).max())).round().item()
        24.0
    """
    lattice = sphere_directions(2 * count)[:count]
    # A large lattice is even enough, and each step would be slow.
    spread = _repelled(lattice) if count <= _MAX_SPREAD else lattice
    return spread if seed == 0 else np.asarray(spread @ _random_rotation(seed).T)


def _repelled(directions: NDArray[np.float64]) -> NDArray[np.float64]:
    """Repel directions and their opposites from one another, like charges on a sphere."""
    out, size = directions.copy(), len(directions)
    spacing = np.sqrt(2 * np.pi / size)
    for step in range(_STEPS):
        differences = out[:, None] - np.concatenate([out, -out])[None]
        squares = (differences**2).sum(axis=-1)
        squares[np.arange(size), np.arange(size)] = np.inf
        force = (differences / squares[..., None] ** 1.5).sum(axis=1)
        force -= (force * out).sum(axis=1, keepdims=True) * out
        strongest = max(float(np.linalg.norm(force, axis=1).max()), 1e-12)
        out += force * (0.3 * spacing / strongest * (1 - step / _STEPS))
        out /= np.linalg.norm(out, axis=1, keepdims=True)
    return out


def _random_rotation(seed: int) -> NDArray[np.float64]:
    """A random rotation."""
    q, r = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    return np.asarray(q * np.sign(np.diag(r)))


def load_mesh(path: Path) -> Any:
    """Read a mesh file.

    Args:
        path: Any format that trimesh reads (PLY, STL, OBJ, OFF, GLB, ...).

    Returns:
        A ``trimesh.Trimesh`` with at least one triangle.

    Raises:
        DatabaseError: The file is missing, is not a mesh or has no triangles.
        ExtraMissingError: trimesh is not installed.
    """
    try:
        import trimesh
    except ImportError as e:
        raise ExtraMissingError("Rendering views of a mesh", "render") from e
    if not path.is_file():
        raise DatabaseError("there is no such mesh file", where=str(path), expected="a mesh file")
    try:
        mesh = trimesh.load_mesh(str(path), process=False)
        vertices, faces = np.asarray(mesh.vertices), np.asarray(mesh.faces)
    except Exception as e:  # trimesh's readers raise errors of every kind
        raise DatabaseError(
            f"this is not a mesh that can be read ({type(e).__name__}: {e})",
            where=str(path),
            expected="a mesh file such as PLY, STL, OBJ or OFF",
        ) from e
    if not _has_size(vertices, faces):
        raise DatabaseError(
            "this mesh has no triangles of finite size", where=str(path), expected="a triangle mesh"
        )
    return mesh


def _has_size(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> bool:
    """Whether all triangles refer to existing vertices, finite and not all at one point."""
    if faces.size == 0 or vertices.size == 0 or not np.isfinite(vertices).all():
        return False
    valid = faces.min() >= 0 and faces.max() < len(vertices)
    return bool(valid and np.ptp(vertices) > 0.0)


def render_views(
    mesh: Any, directions: NDArray[np.float64], image_side: int = IMAGE_SIDE
) -> list[RenderedView]:
    """Silhouettes of a mesh from given directions.

    Args:
        mesh: A ``trimesh.Trimesh``.
        directions: (V, 3) unit vectors from the object to the viewer, mesh frame.
        image_side: Pixels along the longer side of each silhouette.

    Returns:
        One view for each direction.

    Raises:
        ExtraMissingError: embreex is not installed.
    """
    try:
        from trimesh.ray.ray_pyembree import RayMeshIntersector
    except ImportError as e:
        raise ExtraMissingError("Rendering views of a mesh", "render") from e
    centre = 0.5 * (mesh.vertices.min(axis=0) + mesh.vertices.max(axis=0))
    size = float(np.linalg.norm(mesh.vertices - centre, axis=1).max())
    unit = mesh.copy()
    unit.vertices = (mesh.vertices - centre) / size
    rays = RayMeshIntersector(unit)
    points = np.asarray(unit.vertices)
    return [
        _render(rays, points, np.asarray(d, dtype=np.float64), image_side, size) for d in directions
    ]


def _render(
    rays: Any,
    points: NDArray[np.float64],
    direction: NDArray[np.float64],
    image_side: int,
    size: float,
) -> RenderedView:
    """One silhouette of a mesh of unit radius; `size` converts pixels back to mesh units."""
    right, up = image_axes(direction)
    u, v = points @ right, points @ up
    pixel = max(np.ptp(u), np.ptp(v), 1e-6) / image_side
    columns = np.arange(u.min() - 1.5 * pixel, u.max() + 2 * pixel, pixel)
    rows = np.arange(v.max() + 1.5 * pixel, v.min() - 2 * pixel, -pixel)
    grid_u, grid_v = np.meshgrid(columns, rows)
    origins = grid_u[..., None] * right + grid_v[..., None] * up + 2.0 * direction
    towards = np.broadcast_to(-direction, origins.shape).reshape(-1, 3)
    hits = rays.intersects_any(origins.reshape(-1, 3), towards)
    return RenderedView(direction, hits.reshape(grid_u.shape), pixel * size)

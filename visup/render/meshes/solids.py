"""Solids and their primitives.

A solid is a triangle mesh with a reflectance for each face. Joining solids concatenates their triangles:
parts may overlap, which changes neither silhouettes nor shading.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import trimesh
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

Colour = tuple[float, float, float]
"""Reflectance of a face for red, green and blue light, 0 to 1."""

GREY: Colour = (0.6, 0.6, 0.6)
SECTIONS = 40
"""Sides of a round primitive; 40 keep its outline within 0.4 % of the radius."""


@dataclass(frozen=True, slots=True, eq=False)
class Solid:
    """A triangle mesh with a reflectance for each face.

    Attributes:
        vertices: (V, 3) float64, in the solid's own frame, its own unit (metres for spacecraft).
        faces: (F, 3) int64, counter-clockwise seen from outside.
        albedo: (F, 3) float64, reflectance of each face for red, green, blue, 0 to 1.
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]
    albedo: NDArray[np.float64]

    @property
    def normals(self) -> NDArray[np.float64]:
        """(F, 3) outward unit normals; zero for a face without area."""
        a, b, c = (self.vertices[self.faces[:, k]] for k in range(3))
        n = np.cross(b - a, c - a)
        length = np.linalg.norm(n, axis=1, keepdims=True)
        return np.asarray(n / np.where(length > 0, length, 1.0))

    def moved(
        self,
        by: ArrayLike = (0.0, 0.0, 0.0),
        turn: ArrayLike = (0.0, 0.0, 0.0),
        scale: ArrayLike = 1.0,
    ) -> Solid:
        """The solid scaled, then rotated, then translated.

        Args:
            by: (3,) shift.
            turn: (3,) degrees about the fixed x, then y, then z axis.
            scale: One factor, or one for each axis.

        Returns:
            A new solid.
        """
        rotation = Rotation.from_euler("xyz", np.asarray(turn, float), degrees=True)
        vertices = rotation.apply(self.vertices * np.asarray(scale, float)) + np.asarray(by, float)
        return Solid(vertices, self.faces, self.albedo)

    def painted(self, colour: Colour) -> Solid:
        """The solid with one reflectance all over."""
        return Solid(
            self.vertices, self.faces, np.tile(np.asarray(colour, float), (len(self.faces), 1))
        )

    def transformed(self, pose: NDArray[np.float64]) -> Solid:
        """The solid under a rigid motion, (4, 4)."""
        return Solid(self.vertices @ pose[:3, :3].T + pose[:3, 3], self.faces, self.albedo)


def join(*solids: Solid) -> Solid:
    """All solids as one."""
    offsets = np.cumsum([0] + [len(s.vertices) for s in solids[:-1]])
    return Solid(
        np.concatenate([s.vertices for s in solids]),
        np.concatenate([s.faces + o for s, o in zip(solids, offsets, strict=True)]),
        np.concatenate([s.albedo for s in solids]),
    )


def mirrored(solid: Solid, axis: int = 1) -> Solid:
    """The solid and its mirror image across the plane through the origin normal to an axis."""
    flip = np.ones(3)
    flip[axis] = -1
    return join(solid, Solid(solid.vertices * flip, solid.faces[:, ::-1], solid.albedo))


def from_trimesh(mesh: trimesh.Trimesh, colour: Colour = GREY) -> Solid:
    """A trimesh mesh as a solid of one colour."""
    bare = Solid(
        np.asarray(mesh.vertices, float),
        np.asarray(mesh.faces, np.int64),
        np.zeros((len(mesh.faces), 3)),
    )
    return bare.painted(colour)


def box(size: ArrayLike, centre: ArrayLike = (0.0, 0.0, 0.0), colour: Colour = GREY) -> Solid:
    """A box of (x, y, z) extents, centred at a point."""
    return from_trimesh(trimesh.creation.box(extents=np.asarray(size, float)), colour).moved(
        by=centre
    )


def ball(
    radii: ArrayLike, centre: ArrayLike = (0.0, 0.0, 0.0), colour: Colour = GREY, detail: int = 3
) -> Solid:
    """An ellipsoid; one radius, or one for each axis. Each step of detail has four times the faces."""
    mesh = trimesh.creation.icosphere(subdivisions=detail)
    return from_trimesh(mesh, colour).moved(by=centre, scale=radii)


def lathe(
    profile: Sequence[tuple[float, float]], colour: Colour = GREY, sections: int = SECTIONS
) -> Solid:
    """A solid of revolution about z.

    Args:
        profile: (radius, z) points; from the axis up along the outside and back to the axis.
        colour: Reflectance.
        sections: Sides of the round.

    Returns:
        The solid; open where the profile does not reach the axis.
    """
    points = np.asarray(profile, float)
    angles = np.linspace(0, 2 * np.pi, sections, endpoint=False)
    ring = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    vertices = np.concatenate(
        [np.column_stack([ring * r, np.full(sections, z)]) for r, z in points]
    )
    faces = []
    k = np.arange(sections)
    k2 = (k + 1) % sections
    for i in range(len(points) - 1):
        a, b = i * sections, (i + 1) * sections
        if points[i, 0] > 0:
            faces.append(np.stack([a + k, a + k2, b + k2], axis=1))
        if points[i + 1, 0] > 0:
            faces.append(np.stack([a + k, b + k2, b + k], axis=1))
    all_faces = np.concatenate(faces).astype(np.int64)
    return Solid(vertices, all_faces, np.tile(np.asarray(colour, float), (len(all_faces), 1)))


def cone(
    start: ArrayLike,
    end: ArrayLike,
    radius: float,
    end_radius: float | None = None,
    colour: Colour = GREY,
) -> Solid:
    """A closed cylinder or truncated cone between two points.

    Args:
        start: (3,) middle of the first end.
        end: (3,) middle of the other end.
        radius: Radius at the start.
        end_radius: Radius at the end; as at the start when None, 0 for a pointed cone.
        colour: Reflectance.

    Returns:
        The solid.
    """
    top = radius if end_radius is None else end_radius
    a, b = np.asarray(start, float), np.asarray(end, float)
    length = float(np.linalg.norm(b - a))
    upright = lathe([(0, 0), (radius, 0), (top, length), (0, length)], colour)
    return upright.transformed(_align_z(a, b))


def rod(
    start: ArrayLike,
    end: ArrayLike,
    radius: float,
    end_radius: float | None = None,
    colour: Colour = GREY,
) -> Solid:
    """A limb: a cone between two points with round ends."""
    top = radius if end_radius is None else end_radius
    return join(
        cone(start, end, radius, top, colour),
        ball(radius, start, colour, 2),
        ball(top, end, colour, 2),
    )


def limb(points: Sequence[Sequence[float]], radii: Sequence[float], colour: Colour = GREY) -> Solid:
    """Rods end to end through points, with a radius at each."""
    pieces = zip(pairwise(points), pairwise(radii), strict=True)
    return join(*(rod(a, b, r, s, colour) for (a, b), (r, s) in pieces))


def plate(outline: Sequence[tuple[float, float]], thickness: float, colour: Colour = GREY) -> Solid:
    """A plate parallel to xy: an outline, drawn counter-clockwise without crossing itself, made thick.

    Args:
        outline: (x, y) corners; must be star-shaped about their mean.
        thickness: Along z, half on each side.
        colour: Reflectance.

    Returns:
        The solid.
    """
    xy = np.asarray(outline, float)
    n, h = len(xy), thickness / 2
    middle = xy.mean(axis=0)
    vertices = np.array(
        [*[(x, y, -h) for x, y in xy], *[(x, y, h) for x, y in xy], (*middle, -h), (*middle, h)]
    )
    k = np.arange(n)
    k2 = (k + 1) % n
    low, high = np.full(n, 2 * n), np.full(n, 2 * n + 1)
    faces = np.concatenate(
        [
            np.stack([k, k2, n + k2], axis=1),
            np.stack([k, n + k2, n + k], axis=1),
            np.stack([low, k2, k], axis=1),
            np.stack([high, n + k, n + k2], axis=1),
        ]
    )
    return Solid(vertices, faces, np.tile(np.asarray(colour, float), (len(faces), 1)))


def _align_z(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """The rigid motion that takes the z axis to the line from a to b."""
    z = (b - a) / np.linalg.norm(b - a)
    other = np.array([1.0, 0, 0]) if abs(z[0]) < 0.9 else np.array([0, 1.0, 0])
    x = np.cross(other, z)
    x /= np.linalg.norm(x)
    pose = np.eye(4)
    pose[:3, :3] = np.stack([x, np.cross(z, x), z], axis=1)
    pose[:3, 3] = a
    return pose

"""Ray casting against the bodies of a scene, in the camera's frame.

Everything is in camera coordinates: x right, y down, z forward, metres, the pinhole at the
origin. Rays are cast by Embree in single precision.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from embreex import rtcore_scene
from embreex.mesh_construction import TriangleMesh
from numpy.typing import NDArray

from visup.render.meshes.solids import Solid

Floats = NDArray[np.float32]
SHADOW_OFFSET = 1e-3
"""Offset of the origin of a shadow ray from its surface, metres, to avoid hitting it again."""


@dataclass(frozen=True, slots=True, eq=False)
class Body:
    """A solid posed in the camera's frame.

    Attributes:
        name: Its name.
        label: Its value in masks; 0 for scenery.
        solid: Its mesh.
        pose: (4, 4), from the solid's frame to the camera's.
    """

    name: str
    label: int
    solid: Solid
    pose: NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Hits:
    """Hits of N rays.

    Attributes:
        body: (N,) int32, index of the body, -1 for no hit.
        face: (N,) int32, index of the face in the whole scene, -1 for no hit.
        distance: (N,) float32, along the ray in units of its direction; infinite for no hit.
    """

    body: NDArray[np.int32]
    face: NDArray[np.int32]
    distance: Floats


class RayCaster:
    """All bodies of a frame, prepared for ray casting.

    Args:
        bodies: At least one.
    """

    def __init__(self, bodies: Sequence[Body]) -> None:
        self.bodies = tuple(bodies)
        posed = [b.solid.transformed(b.pose) for b in bodies]
        vertices = np.concatenate([s.vertices for s in posed]).astype(np.float32)
        offsets = np.cumsum([0, *(len(s.vertices) for s in posed)])
        faces = np.concatenate([s.faces + n for s, n in zip(posed, offsets, strict=False)])
        self.body = np.repeat(np.arange(len(bodies), dtype=np.int32), [len(s.faces) for s in posed])
        self.normals = np.concatenate([s.normals for s in posed]).astype(np.float32)
        self.albedo = np.concatenate([s.albedo for s in posed]).astype(np.float32)
        self._scene = rtcore_scene.EmbreeScene()
        # With shared vertices it is made in half the time.
        self._mesh = TriangleMesh(self._scene, vertices, faces.astype(np.int32))

    def cast(self, origins: Floats, directions: Floats) -> Hits:
        """The nearest face along each ray; both arguments (N, 3) float32."""
        if len(origins) == 0:
            nothing = np.zeros(0, np.int32)
            return Hits(nothing, nothing, np.zeros(0, np.float32))
        result = self._scene.run(origins, directions, output=1)
        face = np.asarray(result["primID"], np.int32)
        hit = face >= 0
        body = np.where(hit, self.body[np.where(hit, face, 0)], -1).astype(np.int32)
        distance = np.where(hit, result["tfar"], np.inf).astype(np.float32)
        return Hits(body, np.where(hit, face, -1).astype(np.int32), distance)

    def from_pinhole(self, directions: Floats) -> Hits:
        """`cast` for rays that leave the camera."""
        return self.cast(np.zeros_like(directions), directions)

    def occluded(self, points: Floats, normals: Floats, direction: Floats) -> NDArray[np.bool_]:
        """Whether something blocks a distant light from points.

        Args:
            points: (N, 3) on surfaces.
            normals: (N, 3) unit, on the visible side of the surface.
            direction: (3,) unit, towards the light.

        Returns:
            (N,).
        """
        if len(points) == 0:
            return np.zeros(0, bool)
        scale = SHADOW_OFFSET * np.maximum(1.0, np.linalg.norm(points, axis=1, keepdims=True) * 0.1)
        origins = (points + normals * scale).astype(np.float32)
        directions = np.ascontiguousarray(np.broadcast_to(direction, origins.shape), np.float32)
        return np.asarray(self._scene.run(origins, directions, query="INTERSECT")) >= 0

"""Shading: ray hits, reflectance, and light of sky and sun."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from visup.render.imaging.raycast import Body, Hits, RayCaster
from visup.render.scenario.trajectories import inverse
from visup.render.worlds.surfaces import textured_albedo
from visup.render.worlds.world import Daylight, Floats, RigidBody, Sky

CLOUD_SIZE = 0.35
SHADOW_OFFSET = 2e-3
"""Offset of the origin of a shadow ray from its surface, metres, to avoid hitting it again."""


class PosedBodies:
    """Bodies at one time, prepared for ray casting, in world coordinates.

    Args:
        bodies: At least one.
        index: The frame.
    """

    def __init__(self, bodies: Sequence[RigidBody], index: int) -> None:
        self.bodies = tuple(bodies)
        self.caster = RayCaster(
            [Body(t.name, t.label, t.solid, t.poses[min(index, len(t.poses) - 1)]) for t in bodies]
        )
        self.labels = np.array([*(t.label for t in bodies), 0], np.uint8)

    def cast(self, origin: NDArray[np.float64], directions: Floats) -> Hits:
        """First hits of rays from one point; directions (N, 3), world."""
        origins = np.ascontiguousarray(np.broadcast_to(origin, directions.shape), np.float32)
        return self.caster.cast(origins, directions)

    def occluded(self, points: Floats, direction: NDArray[np.float64]) -> NDArray[np.bool_]:
        """(N,): whether something blocks the sun from points (N, 3)."""
        towards_light = np.asarray(direction, np.float32)
        directions = np.ascontiguousarray(np.broadcast_to(towards_light, points.shape), np.float32)
        start = (points + SHADOW_OFFSET * towards_light).astype(np.float32)
        return self.caster.cast(start, directions).body >= 0

    def surface(self, hits: Hits, points: Floats, directions: Floats) -> tuple[Floats, Floats]:
        """Reflectance (N, 3; red, green, blue) and unit normals (N, 3) towards the viewer at hits."""
        albedo = self.caster.albedo[hits.face]
        for number, (rigid_body, posed) in enumerate(
            zip(self.bodies, self.caster.bodies, strict=True)
        ):
            on_body = hits.body == number
            if on_body.any():
                back = inverse(posed.pose)
                local = points[on_body] @ back[:3, :3].T.astype(np.float32) + back[:3, 3]
                albedo[on_body] = textured_albedo(local, albedo[on_body], rigid_body.surface)
        normals = self.caster.normals[hits.face]
        away = np.sum(normals * directions, axis=1, keepdims=True) > 0
        return np.clip(albedo, 0, 1), np.where(away, -normals, normals)


def ambient(normals: Floats, light: Daylight) -> Floats:
    """(N, 3) ambient light on white surfaces: most from above, some reflected from below."""
    share = 0.72 + 0.28 * normals[:, 2:3]
    # A little light from one side, or facing walls would look the same.
    side = 1 + 0.12 * normals[:, :1] - 0.05 * normals[:, 1:2]
    return np.asarray(share * side * np.asarray(light.ambient, np.float32), np.float32)


def direct(normals: Floats, light: Daylight) -> Floats:
    """(N, 3) light of the sun on white surfaces, without shadows."""
    facing = np.clip(normals @ np.asarray(light.sun, np.float32), 0, None)
    return np.asarray(facing[:, None] * np.asarray(light.sun_colour, np.float32), np.float32)


def sky_radiance(directions: Floats, sky: Sky) -> Floats:
    """(N, 3) radiance of the sky in some directions, world."""
    from visup.render.imaging.texture import pattern

    unit = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    altitude = np.clip(unit[:, 2:3], 0, 1) ** 0.6
    blue = (1 - altitude) * np.asarray(sky.horizon) + altitude * np.asarray(sky.zenith)
    flat = unit / (0.25 + np.abs(unit[:, 2:3])) / CLOUD_SIZE / 4
    cloud = sky.clouds * np.clip(0.5 + pattern(flat, sky.seed), 0, 1)[:, None] * (altitude + 0.2)
    return np.asarray(blue * (1 - cloud) + 0.95 * cloud, np.float32)

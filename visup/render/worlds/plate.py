"""The static scene, rendered once for the whole field that the camera covers.

The camera only rotates about its pinhole and zooms, so each image of the static scene is this plate warped by
a homography; only moving bodies are rendered in each frame.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.render.worlds import viewpoint as vp
from visup.render.worlds.shading import PosedBodies, ambient, direct, sky_radiance
from visup.render.worlds.world import Floats, World

BACKGROUND_DISTANCE = 1e4
"""Distance assumed for the background, metres."""


@dataclass(frozen=True, slots=True, eq=False)
class Plate:
    """The static scene, seen by the camera without shake; H and W are those of the plate.

    Attributes:
        ambient: (H, W, 3) radiance without the sun, red, green, blue.
        direct: (H, W, 3) radiance that the sun adds.
        points: (H, W, 3) end points of rays, world, metres.
        labels: (H, W) uint8.
        amodal: Label -> (H, W) uint8, 1 where it would be visible without occluders.
        water: (H, W) uint8, 1 on water.
    """

    ambient: Floats
    direct: Floats
    points: Floats
    labels: NDArray[np.uint8]
    amodal: dict[int, NDArray[np.uint8]]
    water: NDArray[np.uint8]

    def warped(self, matrix: NDArray[np.float64] | None, size: tuple[int, int]) -> Plate:
        """The plate as seen in a frame.

        Args:
            matrix: (3, 3) from pixels of the frame to pixels of the plate; None if both are the same.
            size: Width and height of the frame.
        """
        if matrix is None:
            return self

        def smooth(image: Any) -> Any:
            return _warp(image, matrix, size, cv2.INTER_LINEAR)

        def sharp(image: Any) -> Any:
            return _warp(image, matrix, size, cv2.INTER_NEAREST)

        return Plate(
            smooth(self.ambient),
            smooth(self.direct),
            sharp(self.points),
            sharp(self.labels),
            {label: sharp(seen) for label, seen in self.amodal.items()},
            sharp(self.water),
        )


def _warp(image: Any, matrix: Any, size: tuple[int, int], interpolation: int) -> Any:
    flags = interpolation | cv2.WARP_INVERSE_MAP
    return cv2.warpPerspective(image, matrix, size, flags=flags, borderMode=cv2.BORDER_REPLICATE)


class PlateCamera:
    """The field of the plate, and the mapping from frames to it.

    Args:
        world: The world of the camera.
    """

    def __init__(self, world: World) -> None:
        self.view, (self.width, self.height) = world.viewpoint, world.size
        self.rotation = vp.base_rotation(self.view)
        self.focal = vp.focal_px(self.view, self.height, float(self.view.zoom.max()))
        corners = np.concatenate([self._border(i) for i in range(world.frames)])
        low, high = corners.min(axis=0), corners.max(axis=0)
        # The borders of the plate lie on the pixel grid of a camera on a tripod.
        self.origin = low
        extent = np.ceil((high - low) * self.focal - 1e-6).astype(int) + 1
        self.fixed = not self.view.rotations_deg.any() and bool((self.view.zoom == 1).all())
        self.size = world.size if self.fixed else (int(extent[0]), int(extent[1]))

    def directions(self, shift: tuple[float, float] = (0.0, 0.0)) -> Floats:
        """(H * W, 3) world directions through the plate's pixels, with a subpixel shift."""
        y, x = np.mgrid[: self.size[1], : self.size[0]]
        flat = (
            np.column_stack([x.ravel() + shift[0], y.ravel() + shift[1]]) / self.focal + self.origin
        )
        in_camera = np.column_stack([flat, np.ones(len(flat))])
        return np.asarray(in_camera @ self.rotation.T, np.float32)

    def to_plate(self, index: int) -> NDArray[np.float64] | None:
        """(3, 3) from pixels of a frame to pixels of the plate; None if both are the same."""
        if self.fixed:
            return None
        focal = vp.focal_px(self.view, self.height, float(self.view.zoom[index]))
        from_pixels = np.array(
            [
                [1 / focal, 0, -(self.width - 1) / 2 / focal],
                [0, 1 / focal, -(self.height - 1) / 2 / focal],
                [0, 0, 1],
            ]
        )
        to_plate_pixels = np.array(
            [
                [self.focal, 0, -self.origin[0] * self.focal],
                [0, self.focal, -self.origin[1] * self.focal],
                [0, 0, 1],
            ]
        )
        return np.asarray(to_plate_pixels @ vp.frame_rotation(self.view, index) @ from_pixels)

    def _border(self, index: int) -> NDArray[np.float64]:
        """(N, 2): points of a frame's border on the plane z = 1 of the camera without shake."""
        focal = vp.focal_px(self.view, self.height, float(self.view.zoom[index]))
        x, y = self.width - 1, self.height - 1
        border_points = np.array([(a * x, b * y) for a in (0, 0.5, 1) for b in (0, 0.5, 1)], float)
        rotated = (
            vp.rays(self.width, self.height, focal, border_points).astype(float)
            @ vp.frame_rotation(self.view, index).T
        )
        return np.asarray(rotated[:, :2] / rotated[:, 2:])


def draw_plate(world: World, camera: PlateCamera, static: PosedBodies) -> Plate:
    """Render the static scene.

    Args:
        world: The world.
        camera: The plate's field.
        static: The static bodies.
    """
    width, height = camera.size
    eye = np.asarray(world.viewpoint.position, float)
    shifts = [(x, y) for x in (-0.25, 0.25) for y in (-0.25, 0.25)]
    samples = [_shaded(world, static, eye, camera.directions(s)) for s in shifts]
    ambient_light, direct_light = (
        np.mean([f[k] for f in samples], axis=0, dtype=np.float32) for k in (0, 1)
    )
    directions = camera.directions()
    hits = static.cast(eye, directions)
    ray_lengths, water = _ray_lengths(world, hits.distance, eye, directions)
    labels = np.where(water, 0, static.labels[hits.body]).astype(np.uint8)
    amodal = {
        label: _unoccluded(world, label, eye, directions).reshape(height, width)
        for label in np.unique(static.labels[static.labels > 0])
    }
    return Plate(
        ambient_light.reshape(height, width, 3),
        direct_light.reshape(height, width, 3),
        (eye + directions * ray_lengths[:, None]).astype(np.float32).reshape(height, width, 3),
        labels.reshape(height, width),
        amodal,
        water.astype(np.uint8).reshape(height, width),
    )


def _ray_lengths(
    world: World, distance: Floats, eye: NDArray[np.float64], directions: Floats
) -> tuple[Floats, NDArray[np.bool_]]:
    """Distance along rays to the first body or water, and whether it is water."""
    lengths = np.where(np.isfinite(distance), distance, BACKGROUND_DISTANCE)
    if world.water is None:
        return lengths, np.zeros(len(lengths), bool)
    down = directions[:, 2] < -1e-4
    water_distance = np.where(down, -eye[2] / np.where(down, directions[:, 2], -1), np.inf)
    is_water = water_distance < lengths
    return np.where(is_water, water_distance, lengths), is_water


def _shaded(
    world: World, static: PosedBodies, eye: NDArray[np.float64], directions: Floats
) -> tuple[Floats, Floats]:
    """(N, 3) radiance without the sun, and the part that the sun adds."""
    hits = static.cast(eye, directions)
    ambient_light, direct_light = (
        sky_radiance(directions, world.sky),
        np.zeros((len(directions), 3), np.float32),
    )
    hit = np.flatnonzero(hits.body >= 0)
    visible = type(hits)(hits.body[hit], hits.face[hit], hits.distance[hit])
    points = (eye + directions[hit] * visible.distance[:, None]).astype(np.float32)
    albedo, normals = static.surface(visible, points, directions[hit])
    ambient_light[hit] = albedo * ambient(normals, world.light)
    sunlight = direct(normals, world.light)
    facing = np.flatnonzero(sunlight.any(axis=1))
    sunlight[facing[static.occluded(points[facing], np.asarray(world.light.sun))]] = 0
    direct_light[hit] = albedo * sunlight
    return ambient_light, direct_light


def _unoccluded(
    world: World, label: int, eye: NDArray[np.float64], directions: Floats
) -> NDArray[np.uint8]:
    """(N,): 1 where a static object would be visible without occluders."""
    bodies = [t for t in world.bodies if t.label == label and not t.moves]
    return (PosedBodies(bodies, 0).cast(eye, directions).body >= 0).astype(np.uint8)

"""The static scene, rendered once for the whole field that the camera covers.

The camera only rotates about its pinhole and zooms, so each image of the static scene is this plate warped by
a homography; only moving things are rendered in each frame.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.render.worlds import viewpoint as vp
from visup.render.worlds.shading import PlacedThings, ambient, direct, sky
from visup.render.worlds.world import Floats, World

FAR = 1e4
"""Distance assumed for the background, metres."""


@dataclass(frozen=True, slots=True, eq=False)
class Plate:
    """The static scene, seen by the camera without shake; H and W are those of the plate.

    Attributes:
        shade: (H, W, 3) radiance without the lamp, red, green, blue.
        lamp: (H, W, 3) radiance that the lamp adds.
        points: (H, W, 3) end points of rays, world, metres.
        labels: (H, W) uint8.
        amodal: Label -> (H, W) uint8, 1 where it would be visible without occluders.
        water: (H, W) uint8, 1 on water.
    """

    shade: Floats
    lamp: Floats
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
            smooth(self.shade),
            smooth(self.lamp),
            sharp(self.points),
            sharp(self.labels),
            {label: sharp(seen) for label, seen in self.amodal.items()},
            sharp(self.water),
        )


def _warp(image: Any, matrix: Any, size: tuple[int, int], how: int) -> Any:
    flags = how | cv2.WARP_INVERSE_MAP
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
        self.fixed = not self.view.turns.any() and bool((self.view.zoom == 1).all())
        self.size = world.size if self.fixed else (int(extent[0]), int(extent[1]))

    def directions(self, shift: tuple[float, float] = (0.0, 0.0)) -> Floats:
        """(H * W, 3) world directions through the plate's pixels, with a subpixel shift."""
        y, x = np.mgrid[: self.size[1], : self.size[0]]
        flat = (
            np.column_stack([x.ravel() + shift[0], y.ravel() + shift[1]]) / self.focal + self.origin
        )
        own = np.column_stack([flat, np.ones(len(flat))])
        return np.asarray(own @ self.rotation.T, np.float32)

    def to_plate(self, index: int) -> NDArray[np.float64] | None:
        """(3, 3) from pixels of a frame to pixels of the plate; None if both are the same."""
        if self.fixed:
            return None
        focal = vp.focal_px(self.view, self.height, float(self.view.zoom[index]))
        lens = np.array(
            [
                [1 / focal, 0, -(self.width - 1) / 2 / focal],
                [0, 1 / focal, -(self.height - 1) / 2 / focal],
                [0, 0, 1],
            ]
        )
        place = np.array(
            [
                [self.focal, 0, -self.origin[0] * self.focal],
                [0, self.focal, -self.origin[1] * self.focal],
                [0, 0, 1],
            ]
        )
        return np.asarray(place @ vp.turn(self.view, index) @ lens)

    def _border(self, index: int) -> NDArray[np.float64]:
        """(N, 2): points of a frame's border on the plane z = 1 of the camera without shake."""
        focal = vp.focal_px(self.view, self.height, float(self.view.zoom[index]))
        x, y = self.width - 1, self.height - 1
        at = np.array([(a * x, b * y) for a in (0, 0.5, 1) for b in (0, 0.5, 1)], float)
        turned = (
            vp.rays(self.width, self.height, focal, at).astype(float) @ vp.turn(self.view, index).T
        )
        return np.asarray(turned[:, :2] / turned[:, 2:])


def draw_plate(world: World, camera: PlateCamera, rest: PlacedThings) -> Plate:
    """Render the static scene.

    Args:
        world: The world.
        camera: The plate's field.
        rest: The static things.
    """
    width, height = camera.size
    eye = np.asarray(world.viewpoint.position, float)
    shifts = [(x, y) for x in (-0.25, 0.25) for y in (-0.25, 0.25)]
    fine = [_shaded(world, rest, eye, camera.directions(s)) for s in shifts]
    shade, lamp = (np.mean([f[k] for f in fine], axis=0, dtype=np.float32) for k in (0, 1))
    directions = camera.directions()
    hits = rest.cast(eye, directions)
    reach, water = _reach(world, hits.distance, eye, directions)
    labels = np.where(water, 0, rest.labels[hits.body]).astype(np.uint8)
    amodal = {
        label: _alone(world, label, eye, directions).reshape(height, width)
        for label in np.unique(rest.labels[rest.labels > 0])
    }
    return Plate(
        shade.reshape(height, width, 3),
        lamp.reshape(height, width, 3),
        (eye + directions * reach[:, None]).astype(np.float32).reshape(height, width, 3),
        labels.reshape(height, width),
        amodal,
        water.astype(np.uint8).reshape(height, width),
    )


def _reach(
    world: World, distance: Floats, eye: NDArray[np.float64], directions: Floats
) -> tuple[Floats, NDArray[np.bool_]]:
    """Distance along rays to the first thing or water, and whether it is water."""
    reach = np.where(np.isfinite(distance), distance, FAR)
    if world.water is None:
        return reach, np.zeros(len(reach), bool)
    down = directions[:, 2] < -1e-4
    level = np.where(down, -eye[2] / np.where(down, directions[:, 2], -1), np.inf)
    wet = level < reach
    return np.where(wet, level, reach), wet


def _shaded(
    world: World, rest: PlacedThings, eye: NDArray[np.float64], directions: Floats
) -> tuple[Floats, Floats]:
    """(N, 3) radiance without the lamp, and the part that the lamp adds."""
    hits = rest.cast(eye, directions)
    shade, lamp = sky(directions, world.heaven), np.zeros((len(directions), 3), np.float32)
    met = np.flatnonzero(hits.body >= 0)
    seen = type(hits)(hits.body[met], hits.face[met], hits.distance[met])
    points = (eye + directions[met] * seen.distance[:, None]).astype(np.float32)
    albedo, normals = rest.surface(seen, points, directions[met])
    shade[met] = albedo * ambient(normals, world.light)
    sunny = direct(normals, world.light)
    facing = np.flatnonzero(sunny.any(axis=1))
    sunny[facing[rest.blocked(points[facing], np.asarray(world.light.sun))]] = 0
    lamp[met] = albedo * sunny
    return shade, lamp


def _alone(
    world: World, label: int, eye: NDArray[np.float64], directions: Floats
) -> NDArray[np.uint8]:
    """(N,): 1 where a static object would be visible without occluders."""
    things = [t for t in world.things if t.label == label and not t.moves]
    return (PlacedThings(things, 0).cast(eye, directions).body >= 0).astype(np.uint8)

"""From a world and a frame number to an image, a mask and the visibility of each object."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.render.imaging.raycast import Hits
from visup.render.imaging.renderer import RenderedFrame
from visup.render.imaging.sensor import expose
from visup.render.scenario.optics import Sensor
from visup.render.worlds import viewpoint as vp
from visup.render.worlds import water
from visup.render.worlds.motion import frame_times
from visup.render.worlds.plate import Plate, PlateCamera, draw_plate
from visup.render.worlds.shading import PosedBodies, ambient, direct
from visup.render.worlds.world import Floats, RigidBody, World

EDGE_SAMPLES = 2
"""Rays along each side of a pixel on the edge of a moving body."""

NEAR_PLANE = 1e-3
DEPTH_TOLERANCE = 1e-4
"""Share of the distance by which a moving body must be nearer than the static scene to hide it."""


class WorldRenderer:
    """Renders any frame of a world, in any order.

    Args:
        world: The world; at least one body must be static.
    """

    def __init__(self, world: World) -> None:
        self.world = world
        self.camera = PlateCamera(world)
        self.static = PosedBodies([t for t in world.bodies if not t.moves], 0)
        self.moving = tuple(t for t in world.bodies if t.moves)
        self.plate = draw_plate(world, self.camera, self.static)
        self.sun = np.asarray(world.light.sun, float)
        self._shadow_axes = np.linalg.svd(self.sun[None])[2][1:].astype(np.float32)
        self._eye = np.asarray(world.viewpoint.position, float)

    def render(self, index: int) -> RenderedFrame:
        """Render one frame; depends only on the world and the index."""
        plate = self.plate.warped(self.camera.to_plate(index), self.world.size)
        scene = PosedBodies(self.moving, index) if self.moving else None
        light = self._static_radiance(plate, scene, index)
        mask, amodal = plate.labels.copy(), {}
        if scene is not None:
            window = self._window(self.moving, index)
            mask = self._draw(plate, scene, light, window, index)
        for name, label in self.world.labels.items():
            amodal[name] = self._amodal(plate, label, index)
        return RenderedFrame(index, self._expose(light, index), mask, amodal, {})

    def mask(self, index: int) -> NDArray[np.uint8]:
        """(H, W) labels of a frame, as from `render` but without shading: about ten times as fast."""
        plate = self.plate.warped(self.camera.to_plate(index), self.world.size)
        if not self.moving:
            return plate.labels.copy()
        scene = PosedBodies(self.moving, index)
        width = self.world.size[0]
        pixels = np.flatnonzero(self._window(self.moving, index))
        static_distance = np.linalg.norm(plate.points.reshape(-1, 3)[pixels] - self._eye, axis=1)
        image_points = np.column_stack([pixels % width, pixels // width]).astype(float)
        _, _, body = self._visible_hits(scene, image_points, static_distance, index)
        return self._labelled(plate, scene, pixels, body)

    def _expose(self, light: Floats, index: int) -> NDArray[np.uint8]:
        """(H, W, 3) uint8, BGR, as the camera records it."""
        settings = self.world.sensor
        sensor = Sensor(exposure=settings.exposure, noise=settings.noise, blur_px=settings.blur_px)
        image = expose(np.ascontiguousarray(light[..., ::-1]), sensor, self.world.seed, index)
        _, data = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, settings.jpeg])
        return np.asarray(cv2.imdecode(data, cv2.IMREAD_COLOR), np.uint8)

    def _static_radiance(self, plate: Plate, scene: PosedBodies | None, index: int) -> Floats:
        """(H, W, 3) radiance of the static scene, with the shadows of moving bodies."""
        hidden = self._shadows(plate, scene)
        light = plate.ambient + plate.direct * (1 - hidden[..., None])
        world = self.world
        if world.water is not None:
            is_water = plate.water > 0
            time = float(frame_times(index + 1)[-1])
            drawn = water.water_radiance(
                plate.points[is_water], world.viewpoint.position, time, world.water, world.sky
            )
            light[is_water] = drawn * (
                1 - water.shadow_loss(world.light) * hidden[is_water][:, None]
            )
        return light

    def _shadows(self, plate: Plate, scene: PosedBodies | None) -> Floats:
        """(H, W): share of the sun's light that moving bodies block from the static scene."""
        hidden = np.zeros(plate.labels.shape, np.float32)
        if scene is None:
            return hidden
        sunlit = plate.direct[..., 1] > 0
        if self.world.water is not None:
            sunlit |= plate.water > 0
        s, t = self._shadow_axes @ plate.points[sunlit].T
        near = np.zeros(len(s), bool)
        for body in scene.caster.bodies:
            corners = body.solid.vertices @ body.pose[:3, :3].T + body.pose[:3, 3]
            outline = corners.astype(np.float32) @ self._shadow_axes.T
            (a, b), (c, d) = outline.min(axis=0), outline.max(axis=0)
            near |= (s >= a) & (s <= c) & (t >= b) & (t <= d)
        pixels = np.flatnonzero(sunlit)[near]
        in_shadow = scene.occluded(plate.points.reshape(-1, 3)[pixels], self.sun)
        hidden.ravel()[pixels[in_shadow]] = 1
        softness = self.world.light.softness_px
        return np.asarray(cv2.GaussianBlur(hidden, (0, 0), softness) if softness else hidden)

    def _draw(
        self,
        plate: Plate,
        scene: PosedBodies,
        light: Floats,
        window: NDArray[np.bool_],
        index: int,
    ) -> NDArray[np.uint8]:
        """Draw moving bodies over the static scene, into `light`; returns the (H, W) mask."""
        width, height = self.world.size
        pixels = np.flatnonzero(window)
        flat, static_radiance = light.reshape(-1, 3), light.reshape(-1, 3).copy()
        static_distance = np.linalg.norm(plate.points.reshape(-1, 3)[pixels] - self._eye, axis=1)
        image_points = np.column_stack([pixels % width, pixels // width]).astype(float)
        colour, body = self._shaded(scene, image_points, static_distance, flat[pixels], index)
        flat[pixels] = colour
        bodies = np.full(width * height, -1, np.int16)
        bodies[pixels] = body
        self._antialias(scene, flat, static_radiance, bodies, plate, index)
        return self._labelled(plate, scene, pixels, body)

    def _labelled(
        self,
        plate: Plate,
        scene: PosedBodies,
        pixels: NDArray[np.intp],
        body: NDArray[np.int32],
    ) -> NDArray[np.uint8]:
        """(H, W) labels of the static scene, with those of visible moving bodies."""
        width, height = self.world.size
        mask = plate.labels.ravel().copy()
        mask[pixels[body >= 0]] = scene.labels[body[body >= 0]]
        return mask.reshape(height, width)

    def _visible_hits(
        self,
        scene: PosedBodies,
        image_points: NDArray[np.float64],
        static_distance: Floats,
        index: int,
    ) -> tuple[Floats, Hits, NDArray[np.int32]]:
        """Rays through image points (N, 2), their hits, and the visible moving body, -1 for none."""
        directions = self._directions(image_points, index)
        hits = scene.cast(self._eye, directions)
        in_front = hits.distance * np.linalg.norm(directions, axis=1) < static_distance * (
            1 - DEPTH_TOLERANCE
        )
        return directions, hits, np.where(in_front, hits.body, -1).astype(np.int32)

    def _shaded(
        self,
        scene: PosedBodies,
        image_points: NDArray[np.float64],
        static_distance: Floats,
        behind: Floats,
        index: int,
    ) -> tuple[Floats, NDArray[np.int32]]:
        """Colours (N, 3) at image points (N, 2), and the visible moving body, -1 for none."""
        directions, hits, body = self._visible_hits(scene, image_points, static_distance, index)
        hit = np.flatnonzero(body >= 0)
        visible = Hits(hits.body[hit], hits.face[hit], hits.distance[hit])
        points = (self._eye + directions[hit] * visible.distance[:, None]).astype(np.float32)
        albedo, normals = scene.surface(visible, points, directions[hit])
        sunlight = direct(normals, self.world.light)
        facing = np.flatnonzero(sunlight.any(axis=1))
        in_shadow = scene.occluded(points[facing], self.sun) | self.static.occluded(
            points[facing], self.sun
        )
        sunlight[facing[in_shadow]] = 0
        colour = behind.copy()
        colour[hit] = albedo * (ambient(normals, self.world.light) + sunlight)
        return colour, body

    def _antialias(
        self,
        scene: PosedBodies,
        flat: Floats,
        static_radiance: Floats,
        bodies: NDArray[np.int16],
        plate: Plate,
        index: int,
    ) -> None:
        """Replace pixels on edges of moving bodies by the mean over a grid of rays within them."""
        width, height = self.world.size
        kernel = np.ones((3, 3), np.uint8)
        edges = cv2.morphologyEx(bodies.reshape(height, width), cv2.MORPH_GRADIENT, kernel) > 0
        edge = np.flatnonzero(edges)
        if len(edge) == 0:
            return
        steps = (np.arange(EDGE_SAMPLES) + 0.5) / EDGE_SAMPLES - 0.5
        grid = np.array([(x, y) for y in steps for x in steps])
        centres = np.column_stack([edge % width, edge // width]).astype(float)
        static_distance = np.linalg.norm(plate.points.reshape(-1, 3)[edge] - self._eye, axis=1)
        times = len(grid)
        colour, _ = self._shaded(
            scene,
            (centres[:, None] + grid).reshape(-1, 2),
            np.repeat(static_distance, times),
            np.repeat(static_radiance[edge], times, axis=0),
            index,
        )
        flat[edge] = colour.reshape(len(edge), times, 3).mean(axis=1)

    def _directions(self, image_points: NDArray[np.float64], index: int) -> Floats:
        """(N, 3) world directions through points of a frame."""
        view, (width, height) = self.world.viewpoint, self.world.size
        focal = vp.focal_px(view, height, float(view.zoom[index]))
        rotation = self.camera.rotation @ vp.frame_rotation(view, index)
        in_camera = vp.rays(width, height, focal, image_points)
        return np.ascontiguousarray(in_camera @ rotation.T.astype(np.float32))

    def _window(self, bodies: tuple[RigidBody, ...], index: int) -> NDArray[np.bool_]:
        """(H * W,): pixels inside the bounding boxes of projected bodies."""
        view, (width, height) = self.world.viewpoint, self.world.size
        focal = vp.focal_px(view, height, float(view.zoom[index]))
        rotation = self.camera.rotation @ vp.frame_rotation(view, index)
        window = np.zeros((height, width), bool)
        for body in bodies:
            pose = body.poses[min(index, len(body.poses) - 1)]
            corners = body.solid.vertices @ pose[:3, :3].T + pose[:3, 3]
            in_camera = (corners - self._eye) @ rotation
            if (in_camera[:, 2] > NEAR_PLANE).all():
                xy = in_camera[:, :2] / in_camera[:, 2:] * focal + [
                    (width - 1) / 2,
                    (height - 1) / 2,
                ]
                x0, y0 = np.clip(np.floor(xy.min(axis=0)) - 1, 0, [width, height]).astype(int)
                x1, y1 = np.clip(np.ceil(xy.max(axis=0)) + 2, 0, [width, height]).astype(int)
                window[y0:y1, x0:x1] = True
            elif (in_camera[:, 2] > NEAR_PLANE).any():
                window[:] = True
        return window.ravel()

    def _amodal(self, plate: Plate, label: int, index: int) -> int:
        """Pixels of an object without occluders."""
        if label in plate.amodal:
            return int(np.count_nonzero(plate.amodal[label]))
        bodies = tuple(t for t in self.moving if t.label == label)
        pixels = np.flatnonzero(self._window(bodies, index))
        width = self.world.size[0]
        image_points = np.column_stack([pixels % width, pixels // width]).astype(float)
        hits = PosedBodies(bodies, index).cast(self._eye, self._directions(image_points, index))
        return int(np.count_nonzero(hits.body >= 0))

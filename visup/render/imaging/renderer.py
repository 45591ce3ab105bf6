"""The frame loop: from a scenario and a frame number to an image, a mask and ground truth."""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.render.imaging import background as backgrounds
from visup.render.imaging.raycast import Body, Hits, RayCaster
from visup.render.imaging.scene_poses import PosedScene
from visup.render.imaging.sensor import expose
from visup.render.imaging.texture import pattern
from visup.render.scenario.optics import Camera, Earth, Light, Panorama
from visup.render.scenario.scenario import Scenario
from visup.render.scenario.trajectories import (
    Matrix,
    inverse,
)

Floats = NDArray[np.float32]
EDGE_SAMPLES = 3
"""Rays along each side of a pixel on an edge; other pixels have one."""


@dataclass(frozen=True, slots=True, eq=False)
class RenderedFrame:
    """A rendered frame.

    Attributes:
        index: Number of the frame.
        image: (H, W, 3) uint8, BGR.
        mask: (H, W) uint8, the label hit by the ray through the centre of each pixel.
        amodal_px: For each labelled object, its pixels if nothing occluded it.
        poses: For each labelled rigid object, (4, 4) from its frame to the camera's; arms have none.
    """

    index: int
    image: NDArray[np.uint8]
    mask: NDArray[np.uint8]
    amodal_px: dict[str, int]
    poses: dict[str, Matrix]


def pixel_rays(camera: Camera, points: NDArray[np.float64] | None = None) -> Floats:
    """Directions of rays through points of the image.

    Args:
        camera: Size and field of view; square pixels, the optical axis through the centre of the image.
        points: (N, 2) points (x, y) in pixels; None for the centres of all pixels, row by row.

    Returns:
        (N, 3) float32 in the camera's frame, z = 1.
    """
    width, height = camera.size
    if points is None:
        y, x = np.mgrid[:height, :width]
        points = np.column_stack([x.ravel(), y.ravel()]).astype(float)
    flat = (points - [(width - 1) / 2, (height - 1) / 2]) / camera.focal_px
    return np.column_stack([flat, np.ones(len(flat))]).astype(np.float32)


@dataclass(frozen=True, slots=True, eq=False)
class CameraView:
    """Camera and light at a time.

    Attributes:
        time: Seconds.
        camera: With its current zoom.
        pose: (4, 4), from the camera's frame to the world's.
        light: With its current strength.
        rays: (H * W, 3) float32 through the pixels, row by row, in the camera's frame.
    """

    time: float
    camera: Camera
    pose: Matrix
    light: Light
    rays: Floats


class Renderer:
    """Renders any frame of a scenario, in any order.

    Args:
        scenario: What to render.

    Raises:
        SettingsError: A mesh is missing, or an arm cannot reach.
    """

    def __init__(self, scenario: Scenario) -> None:
        self.scenario = scenario
        self.scene = PosedScene(scenario)
        self._cached_rays: tuple[float, Floats] | None = None
        self._cached_background: tuple[object, Floats] | None = None

    def render(self, index: int) -> RenderedFrame:
        """Render one frame.

        Args:
            index: Number of the frame, from 0.

        Returns:
            The frame; depends only on the scenario and the index.
        """
        view = self.view(index)
        bodies = self.scene.bodies(view.time, view.pose)
        caster = RayCaster(bodies)
        width, height = view.camera.size
        inside = self._bounding_window(bodies, view)
        hits = _scatter(caster.from_pinhole(view.rays[inside]), inside)
        background = self._background(view).reshape(-1, 3)
        radiance = self._shade(caster, hits, view.rays, background, view)
        self._antialias_edges(radiance, caster, hits, background, view)
        sensor = self.scenario.sensor.at(view.time)
        image = expose(radiance.reshape(height, width, 3), sensor, self.scenario.seed, index)
        return RenderedFrame(
            index,
            image,
            self._labels(bodies, hits),
            self._amodal(bodies, hits, view),
            {b.name: b.pose for b in bodies if b.label and b.name in self.scene.solids},
        )

    def mask(self, index: int) -> NDArray[np.uint8]:
        """Only the mask of a frame, (H, W) uint8, as from `render` but much faster."""
        view = self.view(index)
        bodies = self.scene.bodies(view.time, view.pose)
        inside = self._bounding_window(bodies, view)
        return self._labels(
            bodies, _scatter(RayCaster(bodies).from_pinhole(view.rays[inside]), inside)
        )

    def view(self, index: int) -> CameraView:
        """Camera and light in a frame."""
        time = index / self.scenario.camera.fps
        camera = self.scenario.camera.at(time)
        if self._cached_rays is None or self._cached_rays[0] != camera.fov_vertical_deg:
            self._cached_rays = (camera.fov_vertical_deg, pixel_rays(camera))
        light = self.scenario.light.at(time)
        return CameraView(time, camera, self.scene.camera_pose(time), light, self._cached_rays[1])

    def _labels(self, bodies: list[Body], hits: Hits) -> NDArray[np.uint8]:
        """(H, W): the label that each ray hit."""
        width, height = self.scenario.camera.size
        return np.array([*(b.label for b in bodies), 0], np.uint8)[hits.body].reshape(height, width)

    def _bounding_window(self, bodies: list[Body], view: CameraView) -> NDArray[np.bool_]:
        """(H * W,): the pixels inside the bounding boxes of the projected bodies."""
        width, height = view.camera.size
        window = np.zeros((height, width), bool)
        for body in bodies:
            x0, y0, x1, y1 = _projected_box(body, view.camera)
            window[y0:y1, x0:x1] = True
        return window.ravel()

    def _amodal(self, bodies: list[Body], hits: Hits, view: CameraView) -> dict[str, int]:
        """Pixels of each labelled object without occluders, from the hits with all bodies."""
        counts = {}
        for number, body in enumerate(bodies):
            if not body.label:
                continue
            visible = int(np.count_nonzero(hits.body == number))
            # Only where another body is in front may it be hidden.
            window = self._bounding_window([body], view) & (hits.body >= 0) & (hits.body != number)
            hidden = RayCaster([body]).from_pinhole(view.rays[window]).body if window.any() else ()
            counts[body.name] = visible + int(np.count_nonzero(np.asarray(hidden) >= 0))
        return counts

    def _background(self, view: CameraView) -> Floats:
        """(H, W, 3) radiance; cached between frames while it does not change."""
        settings = self.scenario.background
        moving = isinstance(settings, Earth) and settings.turn_deg_per_s != 0
        fov, light = view.camera.fov_vertical_deg, view.light.strength
        key = (view.pose[:3, :3].tobytes(), fov, light, view.time if moving else 0.0)
        if self._cached_background is None or self._cached_background[0] != key:
            self._cached_background = (key, self._draw_background(view))
        return self._cached_background[1]

    def _draw_background(self, view: CameraView) -> Floats:
        settings, rotation = self.scenario.background, view.pose[:3, :3]
        width, height = view.camera.size
        if isinstance(settings, Panorama):
            drawn = backgrounds.panorama(self._view_directions(view), settings) * np.float32(
                view.light.strength
            )
            return np.asarray(drawn.reshape(height, width, 3))
        drawn = backgrounds.stars(view.camera, rotation, settings)
        if isinstance(settings, Earth):
            rotation_of_ground = backgrounds.ground_rotation(settings, view.time)
            light, hit = backgrounds.earth(
                self._view_directions(view), rotation_of_ground, settings, view.light
            )
            drawn.reshape(-1, 3)[hit] = light[hit] * np.float32(view.light.strength)
        return drawn

    def _view_directions(self, view: CameraView) -> Floats:
        """(H * W, 3) unit directions through the pixels, world."""
        rays = view.rays @ view.pose[:3, :3].T.astype(np.float32)
        return np.asarray(rays / np.linalg.norm(rays, axis=1, keepdims=True))

    def _shade(
        self, caster: RayCaster, hits: Hits, rays: Floats, background: Floats, view: CameraView
    ) -> Floats:
        """(N, 3) radiance along rays from the pinhole, BGR."""
        radiance = background.copy()
        hit = hits.body >= 0
        face, rays = hits.face[hit], rays[hit]
        points = rays * hits.distance[hit][:, None]
        normals = caster.normals[face]
        # Thin shells are two-sided: normals always face the camera.
        normals = np.where(np.sum(normals * rays, axis=1, keepdims=True) > 0, -normals, normals)
        light = view.light
        sun, earth = (_to_camera(view.pose, d) for d in (light.sun, light.earth))
        facing = np.clip(normals @ sun, 0.0, None)
        lit = np.flatnonzero(facing > 0)
        facing[lit[caster.occluded(points[lit], normals[lit], sun)]] = 0.0
        # The Earth fills half the sky: its light falls off gently with the angle to it.
        glow = light.earthshine * np.maximum(0.5 + 0.5 * (normals @ earth), 0.0)
        strength = np.float32(light.strength) * (facing + glow)
        albedo = caster.albedo[face] * self._texture_factor(caster, hits.body[hit], points)[:, None]
        radiance[hit] = albedo[:, ::-1] * strength[:, None]
        return radiance

    def _texture_factor(self, caster: RayCaster, body: NDArray[np.int32], points: Floats) -> Floats:
        """(N,) factors of reflectance at points on bodies, from their textures."""
        factor = np.ones(len(points), np.float32)
        for number, placed in enumerate(caster.bodies):
            texture = self.scene.objects[placed.name].texture
            on_body = body == number
            if texture is not None and on_body.any():
                from_camera = inverse(placed.pose)
                local = points[on_body] @ from_camera[:3, :3].T + from_camera[:3, 3]
                grain = pattern(local / texture.size, texture.seed)
                factor[on_body] = np.maximum(1 + texture.contrast * grain, 0)
        return factor

    def _antialias_edges(
        self, radiance: Floats, caster: RayCaster, hits: Hits, background: Floats, view: CameraView
    ) -> None:
        """Replace pixels on edges by the mean over a grid of rays within them."""
        width, height = view.camera.size
        edge = np.flatnonzero(
            _edges(radiance.reshape(height, width, 3), hits.body.reshape(height, width))
        )
        if len(edge) == 0:
            return
        steps = (np.arange(EDGE_SAMPLES) + 0.5) / EDGE_SAMPLES - 0.5
        grid = np.array([(x, y) for y in steps for x in steps])
        centres = np.column_stack([edge % width, edge // width]).astype(float)
        points = (centres[:, None] + grid).reshape(-1, 2)
        rays = pixel_rays(view.camera, points)
        hidden = np.repeat(background[edge], len(grid), axis=0)
        fine = self._shade(caster, caster.from_pinhole(rays), rays, hidden, view)
        radiance[edge] = fine.reshape(len(edge), len(grid), 3).mean(axis=1)


def _to_camera(camera: Matrix, direction: tuple[float, float, float]) -> Floats:
    d = camera[:3, :3].T @ np.asarray(direction, float)
    return np.asarray(d / np.linalg.norm(d), np.float32)


def _scatter(hits: Hits, inside: NDArray[np.bool_]) -> Hits:
    """Hits of some rays, scattered into the array of all."""
    body = np.full(len(inside), -1, np.int32)
    face = np.full(len(inside), -1, np.int32)
    distance = np.full(len(inside), np.inf, np.float32)
    body[inside], face[inside], distance[inside] = hits.body, hits.face, hits.distance
    return replace(hits, body=body, face=face, distance=distance)


def _edges(radiance: Floats, body: NDArray[np.int32]) -> NDArray[np.bool_]:
    """(H, W): pixels next to another body, or to clearly different shading on the same one."""
    grey = np.sqrt(radiance.mean(axis=2))
    kernel = np.ones((3, 3), np.uint8)
    contrast = cv2.morphologyEx(grey, cv2.MORPH_GRADIENT, kernel) > 0.05
    outline = cv2.morphologyEx((body + 1).astype(np.int16), cv2.MORPH_GRADIENT, kernel) > 0
    near = cv2.dilate((body >= 0).astype(np.uint8), kernel) > 0
    return (contrast & near) | outline


def _projected_box(body: Body, camera: Camera) -> tuple[int, int, int, int]:
    """(x0, y0, x1, y1), half open: pixels that a body may cover; all if it passes the pinhole."""
    width, height = camera.size
    points = body.solid.vertices @ body.pose[:3, :3].T + body.pose[:3, 3]
    near = 1e-3
    if (points[:, 2] <= near).all():
        return 0, 0, 0, 0
    if (points[:, 2] <= near).any():
        return 0, 0, width, height
    xy = points[:, :2] / points[:, 2:] * camera.focal_px + [(width - 1) / 2, (height - 1) / 2]
    low, high = np.floor(xy.min(axis=0)) - 1, np.ceil(xy.max(axis=0)) + 2
    x0, y0 = np.clip(low, 0, [width, height]).astype(int)
    x1, y1 = np.clip(high, 0, [width, height]).astype(int)
    return int(x0), int(y0), int(x1), int(y1)

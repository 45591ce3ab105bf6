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
from visup.render.worlds import water as waters
from visup.render.worlds.motion import clock
from visup.render.worlds.plate import Plate, PlateCamera, draw_plate
from visup.render.worlds.shading import PlacedThings, ambient, direct
from visup.render.worlds.world import Floats, Thing, World

SUBRAYS = 2
"""Rays along each side of a pixel on the edge of a moving thing."""

NEAR = 1e-3
SURFACE = 1e-4
"""Share of the distance by which a moving thing must be nearer than the static scene to hide it."""


class WorldRenderer:
    """Renders any frame of a world, in any order.

    Args:
        world: The world; at least one thing must be static.
    """

    def __init__(self, world: World) -> None:
        self.world = world
        self.camera = PlateCamera(world)
        self.rest = PlacedThings([t for t in world.things if not t.moves], 0)
        self.movers = tuple(t for t in world.things if t.moves)
        self.plate = draw_plate(world, self.camera, self.rest)
        self.sun = np.asarray(world.light.sun, float)
        self._across = np.linalg.svd(self.sun[None])[2][1:].astype(np.float32)
        self._eye = np.asarray(world.viewpoint.position, float)

    def picture(self, index: int) -> RenderedFrame:
        """Render one frame; depends only on the world and the index."""
        plate = self.plate.warped(self.camera.to_plate(index), self.world.size)
        scene = PlacedThings(self.movers, index) if self.movers else None
        light = self._resting(plate, scene, index)
        mask, amodal = plate.labels.copy(), {}
        if scene is not None:
            window = self._window(self.movers, index)
            mask = self._draw(plate, scene, light, window, index)
        for name, label in self.world.labels.items():
            amodal[name] = self._amodal(plate, label, index)
        return RenderedFrame(index, self._exposed(light, index), mask, amodal, {})

    def mask(self, index: int) -> NDArray[np.uint8]:
        """(H, W) labels of a frame, as from `picture` but without shading: about ten times as fast."""
        plate = self.plate.warped(self.camera.to_plate(index), self.world.size)
        if not self.movers:
            return plate.labels.copy()
        scene = PlacedThings(self.movers, index)
        width = self.world.size[0]
        places = np.flatnonzero(self._window(self.movers, index))
        far = np.linalg.norm(plate.points.reshape(-1, 3)[places] - self._eye, axis=1)
        at = np.column_stack([places % width, places // width]).astype(float)
        _, _, body = self._met(scene, at, far, index)
        return self._labelled(plate, scene, places, body)

    def _exposed(self, light: Floats, index: int) -> NDArray[np.uint8]:
        """(H, W, 3) uint8, BGR, as the camera records it."""
        imager = self.world.imager
        sensor = Sensor(exposure=imager.exposure, noise=imager.noise, blur_px=imager.blur_px)
        image = expose(np.ascontiguousarray(light[..., ::-1]), sensor, self.world.seed, index)
        _, data = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, imager.jpeg])
        return np.asarray(cv2.imdecode(data, cv2.IMREAD_COLOR), np.uint8)

    def _resting(self, plate: Plate, scene: PlacedThings | None, index: int) -> Floats:
        """(H, W, 3) radiance of the static scene, with the shadows of moving things."""
        hidden = self._shadows(plate, scene)
        light = plate.shade + plate.lamp * (1 - hidden[..., None])
        world = self.world
        if world.water is not None:
            wet = plate.water > 0
            time = float(clock(index + 1)[-1])
            drawn = waters.radiance(
                plate.points[wet], world.viewpoint.position, time, world.water, world.heaven
            )
            light[wet] = drawn * (1 - waters.dimmed(world.light) * hidden[wet][:, None])
        return light

    def _shadows(self, plate: Plate, scene: PlacedThings | None) -> Floats:
        """(H, W): share of the lamp's light that moving things block from the static scene."""
        hidden = np.zeros(plate.labels.shape, np.float32)
        if scene is None:
            return hidden
        sunny = plate.lamp[..., 1] > 0
        if self.world.water is not None:
            sunny |= plate.water > 0
        s, t = self._across @ plate.points[sunny].T
        near = np.zeros(len(s), bool)
        for body in scene.caster.bodies:
            corners = body.solid.vertices @ body.pose[:3, :3].T + body.pose[:3, 3]
            outline = corners.astype(np.float32) @ self._across.T
            (a, b), (c, d) = outline.min(axis=0), outline.max(axis=0)
            near |= (s >= a) & (s <= c) & (t >= b) & (t <= d)
        places = np.flatnonzero(sunny)[near]
        dark = scene.blocked(plate.points.reshape(-1, 3)[places], self.sun)
        hidden.ravel()[places[dark]] = 1
        softness = self.world.light.softness_px
        return np.asarray(cv2.GaussianBlur(hidden, (0, 0), softness) if softness else hidden)

    def _draw(
        self,
        plate: Plate,
        scene: PlacedThings,
        light: Floats,
        window: NDArray[np.bool_],
        index: int,
    ) -> NDArray[np.uint8]:
        """Draw moving things over the static scene, into `light`; returns the (H, W) mask."""
        width, height = self.world.size
        places = np.flatnonzero(window)
        flat, rests = light.reshape(-1, 3), light.reshape(-1, 3).copy()
        far = np.linalg.norm(plate.points.reshape(-1, 3)[places] - self._eye, axis=1)
        at = np.column_stack([places % width, places // width]).astype(float)
        colour, body = self._seen(scene, at, far, flat[places], index)
        flat[places] = colour
        bodies = np.full(width * height, -1, np.int16)
        bodies[places] = body
        self._smooth(scene, flat, rests, bodies, plate, index)
        return self._labelled(plate, scene, places, body)

    def _labelled(
        self,
        plate: Plate,
        scene: PlacedThings,
        places: NDArray[np.intp],
        body: NDArray[np.int32],
    ) -> NDArray[np.uint8]:
        """(H, W) labels of the static scene, with those of visible moving things."""
        width, height = self.world.size
        mask = plate.labels.ravel().copy()
        mask[places[body >= 0]] = scene.labels[body[body >= 0]]
        return mask.reshape(height, width)

    def _met(
        self, scene: PlacedThings, at: NDArray[np.float64], far: Floats, index: int
    ) -> tuple[Floats, Hits, NDArray[np.int32]]:
        """Rays through image points (N, 2), their hits, and the visible moving thing, -1 for none."""
        directions = self._directions(at, index)
        hits = scene.cast(self._eye, directions)
        before = hits.distance * np.linalg.norm(directions, axis=1) < far * (1 - SURFACE)
        return directions, hits, np.where(before, hits.body, -1).astype(np.int32)

    def _seen(
        self, scene: PlacedThings, at: NDArray[np.float64], far: Floats, behind: Floats, index: int
    ) -> tuple[Floats, NDArray[np.int32]]:
        """Colours (N, 3) at image points (N, 2), and the visible moving thing, -1 for none."""
        directions, hits, body = self._met(scene, at, far, index)
        met = np.flatnonzero(body >= 0)
        seen = Hits(hits.body[met], hits.face[met], hits.distance[met])
        points = (self._eye + directions[met] * seen.distance[:, None]).astype(np.float32)
        albedo, normals = scene.surface(seen, points, directions[met])
        sunny = direct(normals, self.world.light)
        facing = np.flatnonzero(sunny.any(axis=1))
        dark = scene.blocked(points[facing], self.sun) | self.rest.blocked(points[facing], self.sun)
        sunny[facing[dark]] = 0
        colour = behind.copy()
        colour[met] = albedo * (ambient(normals, self.world.light) + sunny)
        return colour, body

    def _smooth(
        self,
        scene: PlacedThings,
        flat: Floats,
        rests: Floats,
        bodies: NDArray[np.int16],
        plate: Plate,
        index: int,
    ) -> None:
        """Replace pixels on edges of moving things by the mean over a grid of rays within them."""
        width, height = self.world.size
        kernel = np.ones((3, 3), np.uint8)
        edges = cv2.morphologyEx(bodies.reshape(height, width), cv2.MORPH_GRADIENT, kernel) > 0
        edge = np.flatnonzero(edges)
        if len(edge) == 0:
            return
        steps = (np.arange(SUBRAYS) + 0.5) / SUBRAYS - 0.5
        grid = np.array([(x, y) for y in steps for x in steps])
        centres = np.column_stack([edge % width, edge // width]).astype(float)
        far = np.linalg.norm(plate.points.reshape(-1, 3)[edge] - self._eye, axis=1)
        times = len(grid)
        colour, _ = self._seen(
            scene,
            (centres[:, None] + grid).reshape(-1, 2),
            np.repeat(far, times),
            np.repeat(rests[edge], times, axis=0),
            index,
        )
        flat[edge] = colour.reshape(len(edge), times, 3).mean(axis=1)

    def _directions(self, at: NDArray[np.float64], index: int) -> Floats:
        """(N, 3) world directions through points of a frame."""
        view, (width, height) = self.world.viewpoint, self.world.size
        focal = vp.focal_px(view, height, float(view.zoom[index]))
        rotation = self.camera.rotation @ vp.turn(view, index)
        own = vp.rays(width, height, focal, at)
        return np.ascontiguousarray(own @ rotation.T.astype(np.float32))

    def _window(self, things: tuple[Thing, ...], index: int) -> NDArray[np.bool_]:
        """(H * W,): pixels inside the bounding boxes of projected things."""
        view, (width, height) = self.world.viewpoint, self.world.size
        focal = vp.focal_px(view, height, float(view.zoom[index]))
        rotation = self.camera.rotation @ vp.turn(view, index)
        window = np.zeros((height, width), bool)
        for thing in things:
            pose = thing.poses[min(index, len(thing.poses) - 1)]
            corners = thing.solid.vertices @ pose[:3, :3].T + pose[:3, 3]
            own = (corners - self._eye) @ rotation
            if (own[:, 2] > NEAR).all():
                xy = own[:, :2] / own[:, 2:] * focal + [(width - 1) / 2, (height - 1) / 2]
                x0, y0 = np.clip(np.floor(xy.min(axis=0)) - 1, 0, [width, height]).astype(int)
                x1, y1 = np.clip(np.ceil(xy.max(axis=0)) + 2, 0, [width, height]).astype(int)
                window[y0:y1, x0:x1] = True
            elif (own[:, 2] > NEAR).any():
                window[:] = True
        return window.ravel()

    def _amodal(self, plate: Plate, label: int, index: int) -> int:
        """Pixels of an object without occluders."""
        if label in plate.amodal:
            return int(np.count_nonzero(plate.amodal[label]))
        things = tuple(t for t in self.movers if t.label == label)
        places = np.flatnonzero(self._window(things, index))
        width = self.world.size[0]
        at = np.column_stack([places % width, places // width]).astype(float)
        hits = PlacedThings(things, index).cast(self._eye, self._directions(at, index))
        return int(np.count_nonzero(hits.body >= 0))

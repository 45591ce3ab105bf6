"""Backgrounds: stars, a cloudy Earth with its limb, or a distant patterned surface."""

from __future__ import annotations

from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

from visup.render.imaging.texture import pattern
from visup.render.scenario.optics import Camera, Earth, Light, Panorama, Stars
from visup.render.scenario.trajectories import rotation_about

Floats = NDArray[np.float32]
EARTH_RADIUS_KM = 6371.0
MAP_SIDE = 1536
"""Side of the cloud map, pixels."""

ATMOSPHERE_KM = 60.0
"""Height of the atmosphere that appears as the bright limb of the Earth."""

OCEAN = np.array([0.30, 0.17, 0.08], np.float32)
CLOUD = np.array([0.95, 0.95, 0.95], np.float32)
ATMOSPHERE = np.array([0.90, 0.65, 0.45], np.float32)


def stars(camera: Camera, rotation: NDArray[np.float64], settings: Stars | Earth) -> Floats:
    """The starry sky.

    Args:
        camera: Size and field of view.
        rotation: (3, 3), camera to world.
        settings: Number of stars and brightness of the brightest ones.

    Returns:
        (H, W, 3) float32 radiance, BGR.
    """
    width, height = camera.size
    random = np.random.default_rng(settings.seed)
    directions = random.standard_normal((settings.count, 3))
    # Three times as many stars per magnitude, as in the real sky.
    brightness = 3.0 ** (-4.0 * random.random(settings.count)) * min(settings.brightness, 1.0)
    in_camera = directions @ rotation
    in_front = in_camera[:, 2] > 0
    x = camera.focal_px * in_camera[in_front, 0] / in_camera[in_front, 2] + (width - 1) / 2
    y = camera.focal_px * in_camera[in_front, 1] / in_camera[in_front, 2] + (height - 1) / 2
    grey = np.zeros((height, width), np.float32)
    _splat(grey, x, y, brightness[in_front])
    return np.repeat(grey[..., None], 3, axis=2)


def earth(
    rays: Floats, rotation: NDArray[np.float64], settings: Earth, light: Light
) -> tuple[Floats, NDArray[np.bool_]]:
    """The Earth as seen from a low orbit.

    Args:
        rays: (N, 3) float32 unit directions, world.
        rotation: (3, 3), from the world to the Earth's own frame; see `ground_rotation`.
        settings: Altitude, clouds, brightness.
        light: Directions of the Earth and the sun.

    Returns:
        (N, 3) float32 radiance, BGR, and (N,) bool, whether the ray hits the Earth or its atmosphere.
    """
    down = np.asarray(light.earth, float) / np.linalg.norm(light.earth)
    sun = np.asarray(light.sun, float) / np.linalg.norm(light.sun)
    orbit_radius = EARTH_RADIUS_KM + settings.altitude_km
    along = rays.astype(np.float64) @ (down * orbit_radius)
    closest = np.sqrt(np.maximum(orbit_radius**2 - along**2, 0.0))
    closest = np.where(along > 0, closest, np.inf)
    radiance = np.zeros((len(rays), 3), np.float32)
    air = np.clip(1.0 - (closest - EARTH_RADIUS_KM) / ATMOSPHERE_KM, 0.0, 1.0)
    glow = (closest >= EARTH_RADIUS_KM) & (air > 0)
    radiance[glow] = (0.5 * air[glow] ** 2)[:, None] * ATMOSPHERE
    ground = closest < EARTH_RADIUS_KM
    distance = along[ground] - np.sqrt(EARTH_RADIUS_KM**2 - closest[ground] ** 2)
    points = rays[ground] * distance[:, None] - down * orbit_radius
    normals = points / EARTH_RADIUS_KM
    illumination = np.clip(normals @ sun, 0.0, None) * 0.85 + 0.15
    extent = float(np.sqrt(1 - (EARTH_RADIUS_KM / orbit_radius) ** 2))
    ground_points = normals @ rotation @ _perpendicular_axes(down)
    cloud_cover = clouds(ground_points, extent, settings.clouds, settings.seed)[:, None]
    surface = OCEAN * (1 - cloud_cover) + CLOUD * cloud_cover
    haze = np.clip((closest[ground] / EARTH_RADIUS_KM - 0.97) / 0.03, 0.0, 1.0)[:, None] ** 2 * 0.5
    radiance[ground] = (surface * (1 - haze) + ATMOSPHERE * haze) * illumination[:, None]
    return radiance * np.float32(settings.brightness), glow | ground


def panorama(rays: Floats, settings: Panorama) -> Floats:
    """A distant patterned surface on all sides, at rest in the world.

    Args:
        rays: (N, 3) float32 unit directions, world.
        settings: Its colours and the size of its blotches.

    Returns:
        (N, 3) float32 radiance, BGR.
    """
    blend = (0.5 + 0.5 * pattern(rays / np.radians(settings.size_deg), settings.seed))[:, None]
    dark, light = (np.array(c[::-1], np.float32) for c in settings.colours)
    return np.asarray(dark + np.clip(blend, 0, 1) * (light - dark), np.float32)


def ground_rotation(settings: Earth, time: float) -> NDArray[np.float64]:
    """(3, 3) rotation of the ground under the camera at a time."""
    rotation = rotation_about(np.asarray(settings.turn_axis, float), settings.turn_deg_per_s * time)
    return np.asarray(rotation.as_matrix())


def clouds(ground: NDArray[np.float64], extent: float, amount: float, seed: int) -> Floats:
    """Cloud cover over points on the ground.

    Args:
        ground: (N, 2) points in the plane through the centre of the Earth, normal to the line of sight to it,
            in
            Earth radii; unbounded, since the pattern repeats.
        extent: Half the side of the map, Earth radii.
        amount: 0 for a clear sky to 1 for an overcast one.
        seed: Chooses the weather.

    Returns:
        (N,) float32, 0 to 1.
    """
    cloud_map = _cloud_map(extent, amount, seed)
    pixels = (ground / extent + 1) * (MAP_SIDE - 1) / 2
    return np.asarray(map_coordinates(cloud_map, pixels.T, order=1, mode="mirror"), np.float32)


@lru_cache(maxsize=4)
def _cloud_map(extent: float, amount: float, seed: int) -> Floats:
    """(MAP_SIDE, MAP_SIDE): six octaves of noise, thresholded to clouds with soft edges."""
    random = np.random.default_rng(seed)
    total = np.zeros((MAP_SIDE, MAP_SIDE), np.float32)
    weight, cells = 0.5, 30.0
    for _ in range(6):
        side = max(4, round(2 * extent * cells))
        grid = random.random((side, side), dtype=np.float32)
        total += weight * cv2.resize(grid, (MAP_SIDE, MAP_SIDE), interpolation=cv2.INTER_CUBIC)
        weight, cells = weight * 0.58, cells * 2.1
    level = float(np.quantile(total, 1 - amount))
    return np.asarray(np.clip((total - level) / 0.3 + 0.4, 0.0, 1.0), np.float32)


def _perpendicular_axes(down: NDArray[np.float64]) -> NDArray[np.float64]:
    """(3, 2): two directions perpendicular to one and to each other."""
    helper = np.eye(3)[int(np.argmin(np.abs(down)))]
    first = np.cross(down, helper)
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(down, first)], axis=1)


def _splat(
    image: Floats, x: NDArray[np.float64], y: NDArray[np.float64], light: NDArray[np.float64]
) -> None:
    """Add points of light, distributed bilinearly over four pixels."""
    height, width = image.shape
    x0, y0 = np.floor(x).astype(int), np.floor(y).astype(int)
    fx, fy = x - x0, y - y0
    for dx, dy, share in (
        (0, 0, (1 - fx) * (1 - fy)),
        (1, 0, fx * (1 - fy)),
        (0, 1, (1 - fx) * fy),
        (1, 1, fx * fy),
    ):
        inside = (x0 + dx >= 0) & (x0 + dx < width) & (y0 + dy >= 0) & (y0 + dy < height)
        np.add.at(image, (y0[inside] + dy, x0[inside] + dx), (light * share)[inside])

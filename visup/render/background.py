"""What is behind everything: stars that stand still in the world, or a cloudy Earth with its limb."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from visup.render.scenario import Camera, Earth, Light, Stars
from visup.render.tracks import spin_about

Floats = NDArray[np.float32]
EARTH_RADIUS_KM = 6371.0
AIR_KM = 60.0
"""Height of the air that shows as the bright rim of the Earth."""

OCEAN = np.array([0.30, 0.17, 0.08], np.float32)
CLOUD = np.array([0.95, 0.95, 0.95], np.float32)
AIR = np.array([0.90, 0.65, 0.45], np.float32)


def stars(camera: Camera, rotation: NDArray[np.float64], settings: Stars | Earth) -> Floats:
    """The starry sky.

    Args:
        camera: Size and field of view.
        rotation: (3, 3), camera to world.
        settings: How many stars and how bright the brightest ones are.

    Returns:
        (H, W, 3) float32 radiance, BGR.
    """
    width, height = camera.size
    random = np.random.default_rng(settings.seed)
    directions = random.standard_normal((settings.count, 3))
    # Three times as many stars per magnitude, which is what the sky has.
    light = 3.0 ** (-4.0 * random.random(settings.count)) * min(settings.brightness, 1.0)
    seen = directions @ rotation
    front = seen[:, 2] > 0
    x = camera.focal_px * seen[front, 0] / seen[front, 2] + (width - 1) / 2
    y = camera.focal_px * seen[front, 1] / seen[front, 2] + (height - 1) / 2
    grey = np.zeros((height, width), np.float32)
    _splat(grey, x, y, light[front])
    return np.repeat(grey[..., None], 3, axis=2)


def earth(
    rays: Floats, rotation: NDArray[np.float64], settings: Earth, light: Light
) -> tuple[Floats, NDArray[np.bool_]]:
    """The Earth as seen from a low orbit.

    Args:
        rays: (N, 3) float32 unit directions, world.
        rotation: (3, 3), turns the world to what the Earth itself is drawn in; see `ground_turn`.
        settings: Altitude, clouds, brightness.
        light: Where the Earth and the sun are.

    Returns:
        (N, 3) float32 radiance, BGR, and (N,) bool, whether the ray meets the Earth or its air.
    """
    down = np.asarray(light.earth, float) / np.linalg.norm(light.earth)
    sun = np.asarray(light.sun, float) / np.linalg.norm(light.sun)
    far = EARTH_RADIUS_KM + settings.altitude_km
    along = rays.astype(np.float64) @ (down * far)
    closest = np.sqrt(np.maximum(far**2 - along**2, 0.0))
    closest = np.where(along > 0, closest, np.inf)
    radiance = np.zeros((len(rays), 3), np.float32)
    air = np.clip(1.0 - (closest - EARTH_RADIUS_KM) / AIR_KM, 0.0, 1.0)
    glow = (closest >= EARTH_RADIUS_KM) & (air > 0)
    radiance[glow] = (0.5 * air[glow] ** 2)[:, None] * AIR
    ground = closest < EARTH_RADIUS_KM
    distance = along[ground] - np.sqrt(EARTH_RADIUS_KM**2 - closest[ground] ** 2)
    points = rays[ground] * distance[:, None] - down * far
    normals = points / EARTH_RADIUS_KM
    lit = np.clip(normals @ sun, 0.0, None) * 0.85 + 0.15
    cover = clouds(normals @ rotation, settings.clouds, settings.seed)[:, None]
    surface = OCEAN * (1 - cover) + CLOUD * cover
    haze = np.clip((closest[ground] / EARTH_RADIUS_KM - 0.97) / 0.03, 0.0, 1.0)[:, None] ** 2 * 0.5
    radiance[ground] = (surface * (1 - haze) + AIR * haze) * lit[:, None]
    return radiance * np.float32(settings.brightness), glow | ground


def ground_turn(settings: Earth, time: float) -> NDArray[np.float64]:
    """(3, 3): how the ground has turned under the camera at a time."""
    turn = spin_about(np.asarray(settings.turn_axis, float), settings.turn_deg_per_s * time)
    return np.asarray(turn.as_matrix())


def clouds(points: NDArray[np.float64], amount: float, seed: int) -> Floats:
    """How much cloud there is over points of the unit sphere.

    Args:
        points: (N, 3).
        amount: 0 for a clear sky to 1 for an overcast one.
        seed: Chooses the weather.

    Returns:
        (N,) float32, 0 to 1.
    """
    total = np.zeros(len(points), np.float64)
    weight, scale = 0.5, 14.0
    for octave in range(6):
        total += weight * value_noise(points * scale, seed * 31 + octave)
        weight, scale = weight * 0.58, scale * 2.1
    level = 0.62 - 0.3 * (amount - 0.5)
    return np.asarray(np.clip((total - level + 0.12) / 0.35, 0.0, 1.0), np.float32)


def value_noise(points: NDArray[np.float64], seed: int) -> NDArray[np.float64]:
    """Smooth noise in space: random values on the integer grid, blended in between.

    Args:
        points: (N, 3).
        seed: Of the values.

    Returns:
        (N,), 0 to 1.
    """
    base = np.floor(points).astype(np.int64)
    part = points - base
    blend = part * part * (3 - 2 * part)
    out = np.zeros(len(points))
    for corner in range(8):
        step = np.array([(corner >> k) & 1 for k in range(3)])
        share = np.prod(np.where(step == 1, blend, 1 - blend), axis=1)
        out += share * _grid_value(base + step, seed)
    return out


def _grid_value(cells: NDArray[np.int64], seed: int) -> NDArray[np.float64]:
    """A random value for each cell of the integer grid, by hashing its coordinates."""
    with np.errstate(over="ignore"):
        mixed = cells.astype(np.uint64) * np.array([73856093, 19349663, 83492791], np.uint64)
        h = mixed[:, 0] ^ mixed[:, 1] ^ mixed[:, 2] ^ np.uint64(seed * 2654435761 % 2**32)
        h = (h ^ (h >> np.uint64(15))) * np.uint64(2246822519)
        h = (h ^ (h >> np.uint64(13))) * np.uint64(3266489917)
    return ((h >> np.uint64(16)) & np.uint64(0xFFFF)).astype(np.float64) / 65535.0


def _splat(
    image: Floats, x: NDArray[np.float64], y: NDArray[np.float64], light: NDArray[np.float64]
) -> None:
    """Add points of light, shared bilinearly between four pixels."""
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

"""Water: waves that tilt a mirror of the sky."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from visup.render.worlds.world import Daylight, Floats, Sky, Water

HALF_ROUGHNESS_DISTANCE = 60.0
"""Distance at which waves look half as rough, since a pixel covers several, metres."""


def water_radiance(
    points: Floats, eye: tuple[float, float, float], time: float, water: Water, sky: Sky
) -> Floats:
    """Light from the surface of the water.

    Args:
        points: (N, 3) on the surface, world.
        eye: The camera's position.
        time: Seconds.
        water: Colour and waves.
        sky: The reflected sky.

    Returns:
        (N, 3) radiance, red, green, blue, without shadows.
    """
    x, y = points[:, 0], points[:, 1]
    roughness = np.zeros(len(points), np.float32)
    for number, (kx, ky, speed, slope) in enumerate(water.waves.astype(np.float32)):
        roughness += slope * np.sin(
            kx * x + ky * y - np.float32(speed * time) + np.float32(2.4 * number)
        )
    away = np.asarray(eye, np.float32) - points
    distance = np.linalg.norm(away, axis=1)
    cos_incidence = away[:, 2] / np.maximum(distance, 1e-6)
    roughness /= 1 + (distance / HALF_ROUGHNESS_DISTANCE) ** 2
    # Schlick's approximation, with the reflectance of water at normal incidence.
    reflectance = np.clip(0.04 + 0.96 * (1 - np.clip(cos_incidence, 0, 1)) ** 4 + roughness, 0, 1)[
        :, None
    ]
    reflected_sky = (
        np.asarray(sky.horizon, np.float32) * 0.75 + np.asarray(sky.zenith, np.float32) * 0.25
    )
    body_colour = np.asarray(water.colour, np.float32) * (1 + 1.5 * roughness[:, None])
    return np.asarray((1 - reflectance) * body_colour + reflectance * reflected_sky, np.float32)


def random_waves(rng: np.random.Generator, length: float, steepness: float) -> NDArray[np.float64]:
    """(N, 4) waves about one direction of the wind; `length` is of the longest, metres."""
    count = 12
    heading = rng.uniform(0, 2 * np.pi)
    # Incommensurate lengths: harmonic waves would show a regular pattern.
    lengths = length * np.exp(-rng.uniform(0, 2.3, count))
    angle = heading + rng.normal(0, 0.7, count)
    number = 2 * np.pi / lengths
    speed = np.sqrt(9.81 * number)
    steep = steepness * rng.uniform(0.4, 1.4, count) / np.sqrt(count)
    return np.column_stack([number * np.cos(angle), number * np.sin(angle), speed, steep])


def shadow_loss(light: Daylight) -> float:
    """Share of the water's light that is lost in shadow."""
    return 0.25 * float(np.mean(light.sun_colour)) / (float(np.mean(light.ambient)) + 0.2)

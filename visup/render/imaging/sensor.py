"""From light to bytes: blur, exposure, gamma, noise, eight bits."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.render.scenario.optics import Sensor


def expose(
    radiance: NDArray[np.float32], sensor: Sensor, seed: int, index: int
) -> NDArray[np.uint8]:
    """The image that a sensor records.

    Noise depends only on the seed and the frame number, so that frames can be rendered in any order.

    Args:
        radiance: (H, W, 3) float32, linear, 1.0 for a white surface square to the sun; BGR.
        sensor: Exposure and flaws.
        seed: Seed of the noise.
        index: Number of the frame.

    Returns:
        (H, W, 3) uint8, BGR.
    """
    light = radiance
    if sensor.blur_px > 0:
        light = np.asarray(cv2.GaussianBlur(light, (0, 0), sensor.blur_px), np.float32)
    signal = np.clip(light * sensor.exposure, 0.0, 1.0) ** (1.0 / sensor.gamma)
    grey = sensor.black + signal * (255.0 - sensor.black)
    if sensor.noise > 0:
        random = np.random.default_rng([seed, index])
        # One value for all three channels: a colour camera's luma noise is what survives a codec.
        noise = random.standard_normal(grey.shape[:2], dtype=np.float32)
        grey = grey + sensor.noise * noise[..., None]
    return np.asarray(np.clip(np.rint(grey), 0, 255), np.uint8)

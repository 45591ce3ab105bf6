"""Small clips made on the spot."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray


def moving_disc(count: int = 40, size: tuple[int, int] = (96, 72)) -> list[NDArray[np.uint8]]:
    """A textured disc that crosses a textured ground."""
    width, height = size
    rng = np.random.default_rng(7)
    ground = cv2.GaussianBlur(rng.integers(0, 120, (height, width)).astype(np.uint8), (0, 0), 1.5)
    disc = cv2.GaussianBlur(rng.integers(120, 255, (31, 31)).astype(np.uint8), (0, 0), 1.5)
    yy, xx = np.mgrid[-15:16, -15:16]
    inside = yy**2 + xx**2 <= 13**2
    images = []
    for i in range(count):
        grey = ground.copy()
        x, y = 8 + i, height // 2 - 15
        grey[y : y + 31, x : x + 31][inside] = disc[inside]
        images.append(np.asarray(np.repeat(grey[:, :, None], 3, axis=2), np.uint8))
    return images


def write_clip(path: Path, images: list[NDArray[np.uint8]], fps: float = 25.0) -> Path:
    height, width = images[0].shape[:2]
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), fps, (width, height))
    assert writer.isOpened()
    for image in images:
        writer.write(image)
    writer.release()
    return path

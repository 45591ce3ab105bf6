"""A small clip to teach from: a red square that moves over grey, one pixel a frame."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

SIZE = 160, 120
SIDE = 30
TOP = 40


def frame(number: int) -> NDArray[np.uint8]:
    width, height = SIZE
    image = np.full((height, width, 3), 90, np.uint8)
    image[::8] = 110
    image[TOP : TOP + SIDE, 20 + number : 20 + number + SIDE] = (30, 30, 220)
    return image


def corners(number: int) -> list[tuple[float, float]]:
    left, right, bottom = 20 + number, 20 + number + SIDE - 1, TOP + SIDE - 1
    return [(left, TOP), (right, TOP), (right, bottom), (left, bottom)]


def write_clip(path: Path, count: int = 90) -> Path:
    kind = cv2.VideoWriter.fourcc(*"FFV1")
    video = cv2.VideoWriter(str(path), kind, 25.0, SIZE)
    for number in range(count):
        video.write(frame(number))
    video.release()
    return path

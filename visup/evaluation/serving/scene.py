"""The scene of a rehearsal: an object arrives, stays for a while and leaves; then nothing moves."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.report.video import WebmWriter
from visup.runs.evidence.frame_ring import jpeg_of

SIZE = (640, 480)
FPS = 10.0
CROSSING, EMPTY = 60, 60
"""Frames with and without a crossing object."""

SIDE = 90
RULE = 'rule seen(a): warning\n    when in_view(a) > 0.5 s\n    say "{a} {is} seen."\n'
PACE = 5.0

SITE = """store = "{store}"
sinks = ["webhook:http://127.0.0.1:{port}/alerts", "file:alerts.jsonl"]
recording = {{ state_every = 5.0, run_hours = {hours} }}
evidence = {{ before_s = 2.0, after_s = 2.0 }}
retention = {{ free_gb = {free_gb} }}
monitoring.listen = "127.0.0.1:{monitoring}"
"""
CAMERA = """
[[camera]]
name = "{name}"
source = "{source}"
rules = ["own.rules"]
pace = {pace}
patience_s = 20.0
"""


def scene(seed: int) -> list[NDArray[np.uint8]]:
    """One cycle of the scene.

    Args:
        seed: Random seed.

    Returns:
        Frames, (480, 640, 3) uint8 BGR.
    """
    rng = np.random.default_rng(seed)
    width, height = SIZE
    background = _texture(rng, height, width, 40, 120)
    object_texture = _texture(rng, SIDE, SIDE, 130, 255)
    top = int(rng.integers(40, height - SIDE - 40))
    frames = []
    for number in range(CROSSING + EMPTY):
        image = background.copy()
        left = round((width + SIDE) * number / CROSSING) - SIDE
        begin, end = max(0, left), min(width, left + SIDE)
        if number < CROSSING and begin < end:
            image[top : top + SIDE, begin:end] = object_texture[:, begin - left : end - left]
        frames.append(image)
    return frames


def _texture(
    rng: np.random.Generator, height: int, width: int, low: int, high: int
) -> NDArray[np.uint8]:
    noise = rng.integers(low, high, (height, width, 3)).astype(np.uint8)
    return np.asarray(cv2.GaussianBlur(noise, (0, 0), 2.0), np.uint8)


def write_clip(path: Path, frames: list[NDArray[np.uint8]]) -> None:
    """Write a scene as a video, `.webm`."""
    with WebmWriter(path, FPS) as video:
        for frame in frames:
            video.write(frame)


def jpegs(frames: list[NDArray[np.uint8]]) -> list[bytes]:
    """A scene as JPEG images."""
    return [jpeg_of(frame) for frame in frames]

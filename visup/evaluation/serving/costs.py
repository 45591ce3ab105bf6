"""Processor load of one camera: in an idle scene, and with permanent motion."""

from __future__ import annotations

import time
from itertools import cycle

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.agent import Frame
from visup.evaluation.serving.scene import CROSSING, PACE, scene
from visup.runs.evidence.frame_ring import FrameEncoder, FrameRing
from visup.runs.settings import WatchSettings
from visup.runs.wiring import build_agent
from visup.serving.site.form import CameraTable

NOISE = 2.0
"""Noise of each pixel, grey levels: that of a camera in a lit room."""

WARM_UP_S = 12.0
"""Warm-up until the scene is known, seconds of the source."""

IDLE_S, BUSY_S = 60.0, 6.0
"""Measured time, seconds of the source: idle, and busy."""


def camera_costs(seed: int = 0) -> dict[str, float]:
    """Processor shares of one camera, 640x480 pixels at 5 frames per second.

    Frames are processed as by the service with as many cameras as cores, without decoding and journal;
    processor time is measured, which depends little on other load.

    Args:
        seed: Random seed.

    Returns:
        `idle_cpu`, `idle_cpu_without_rest`, `busy_cpu`.
    """
    cv2.setNumThreads(1)
    frames = scene(seed)
    rest_s = float(CameraTable.model_fields["rest_s"].default)
    return {
        "idle_cpu": _share(frames[-1:], rest_s, IDLE_S, seed),
        "idle_cpu_without_rest": _share(frames[-1:], None, BUSY_S, seed),
        "busy_cpu": _share(frames[4 : CROSSING - 4 : 2], rest_s, BUSY_S, seed),
    }


def _share(
    pictures: list[NDArray[np.uint8]], rest_s: float | None, watched_s: float, seed: int
) -> float:
    """Processor seconds per second of the source."""
    agent = build_agent(WatchSettings(source="scene", rest_s=rest_s), live=True)
    ring, encoded = FrameRing(8.0, 2**25), FrameEncoder()
    noise = _noise(pictures[0].shape, seed)
    used = 0.0
    for number, picture in enumerate(cycle(pictures)):
        now = number / PACE
        if now >= WARM_UP_S + watched_s:
            break
        image = np.clip(picture + noise[number % len(noise)], 0, 255).astype(np.uint8)
        begin = time.process_time()
        agent.step(Frame(number, now, image))
        ring.add(encoded(image, now))
        used += (time.process_time() - begin) if now >= WARM_UP_S else 0.0
    agent.close()
    return used / watched_s


def _noise(shape: tuple[int, ...], seed: int) -> list[NDArray[np.int16]]:
    rng = np.random.default_rng(seed)
    return [np.rint(rng.normal(0.0, NOISE, shape)).astype(np.int16) for _ in range(7)]

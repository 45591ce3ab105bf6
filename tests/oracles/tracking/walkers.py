"""A street of people as boxes: they cross, walk in pairs, stop and go on, near and far."""

from __future__ import annotations

import numpy as np

from visup.percepts.detections.boxes import Box

Random = np.random.Generator
ASPECT = 0.38  # width of a walker as a share of the height
PACE = 0.8  # heights that a walker goes in a second
GAIT = 0.12  # how much wider and narrower the box gets with each step


def street(
    seed: int, *, frames: int = 150, size: tuple[int, int] = (640, 480), fps: float = 15.0
) -> dict[int, dict[int, Box]]:
    """Boxes of walkers who show at least half within the image.

    Args:
        seed: Of all that is drawn.
        frames: How many.
        size: (width, height) of a frame.
        fps: Frames a second.

    Returns:
        Frame -> id -> box.
    """
    rng = np.random.default_rng(seed)
    out: dict[int, dict[int, Box]] = {k: {} for k in range(frames)}
    number = 0
    for _ in range(int(rng.integers(5, 12))):
        begin, foot = float(rng.uniform(-8, frames / fps)), float(rng.uniform(0.45, 1.0))
        speed = float(rng.choice([-1, 1]) * rng.uniform(0.6, 1.4)) * PACE
        stops, slope = rng.random() < 0.3, float(rng.normal(0, 0.015))
        for beside in range(1 + int(rng.random() < 0.3)):
            number += 1
            way = _way(frames, fps, begin, speed, stops, rng)
            for k, box in _boxes(way, foot + 0.02 * beside, slope, 0.5 * beside, size, rng):
                out[k][number] = box
    return out


def _way(
    frames: int, fps: float, begin: float, speed: float, stops: bool, rng: Random
) -> list[float]:
    """How far a walker has gone at each frame, heights; it begins outside."""
    rest = float(rng.uniform(0, frames / fps)) if stops else -1.0
    out, gone = [], 0.0
    for k in range(-int(8 * fps), frames):
        now = k / fps
        walks = now >= begin and not (stops and rest <= now < rest + 2.0)
        gone += (speed * float(rng.normal(1, 0.1)) if walks else 0.0) / fps
        if k >= 0:
            out.append(gone)
    return out


def _boxes(
    way: list[float],
    foot: float,
    slope: float,
    beside: float,
    size: tuple[int, int],
    rng: Random,
) -> list[tuple[int, Box]]:
    """Boxes of one walker in the frames in which it shows."""
    width, height = size
    phase, out = float(rng.uniform(0, 6.3)), []
    forward = way[-1] >= 0
    for k, gone in enumerate(way):
        down = foot + slope * abs(gone)
        tall = 0.3 * height * down
        wide = tall * ASPECT * (1 + GAIT * float(np.sin(phase + 7 * gone)))
        start = -0.5 * tall * ASPECT if forward else width + 0.5 * tall * ASPECT
        x = start + gone * tall + beside * ASPECT * tall
        if 0 < x < width:
            out.append((k, (x - wide / 2, down * height - tall, wide, tall)))
    return out

"""Very long reasoning: time of a step, bounded memory, size of stored minds.

Scripted percepts without images: boxes that drift, meet, flicker, cross the border and return under other ids
and names. Only the reasoners of rules/ are measured.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from visup.agent import (
    Mind,
    Reasoner,
)
from visup.evaluation.figures import Progress, resident_mb, silent
from visup.evaluation.runtime.scripted_observations import FPS, drifting_boxes
from visup.rules.reasoners import default_reasoners

SETTLED_FRAMES = 10_000
"""Frames after which memory must not grow."""

STORED_MINDS = 10_000
"""Number of stored minds to measure the size of one."""


def evaluate_endurance(
    frames: int, *, seed: int = 0, progress: Progress = silent
) -> dict[str, Any]:
    """Run a script with three objects for some frames, and one with ten for a tenth of them.

    Args:
        frames: Number of frames.
        seed: Random seed.
        progress: Shows what is being done.

    Returns:
        {"total": {...}, "items": {}}: `ms` and `ms_ten` (median per step), `rss_mb` at the end and
        `grown` (relative growth since frame 10,000 or the middle, whichever is earlier), and
        `snapshot_kb` per mind of 10,000 consecutive ones.
    """
    settled_frame = min(SETTLED_FRAMES, frames // 2)
    settled_mb, last = 0.0, Mind()
    step_seconds: list[float] = []
    for k, (seconds, mind) in enumerate(_reasoning_steps(3, frames, seed, Mind())):
        last = mind
        if k % 16 == 0:
            step_seconds.append(seconds)
        if k == settled_frame:
            settled_mb = resident_mb()
        if k % 5000 == 0:
            progress(f"{k} of {frames} frames")
    end = resident_mb()
    ten = [
        seconds
        for seconds, _ in _reasoning_steps(10, max(200, min(frames // 10, 2000)), seed, Mind())
    ]
    before = resident_mb()
    minds = [m for _, m in _reasoning_steps(3, min(STORED_MINDS, frames), seed + 1, last)]
    return {
        "total": {
            "frames": frames,
            "ms": 1000 * float(np.median(step_seconds)),
            "ms_ten": 1000 * float(np.median(ten)),
            "rss_mb": end,
            "grown": end / settled_mb - 1.0,
            "snapshot_kb": 1024 * (resident_mb() - before) / len(minds),
        },
        "items": {},
    }


def _reasoning_steps(
    count: int, frames: int, seed: int, mind: Mind
) -> Iterator[tuple[float, Mind]]:
    """Seconds of each step, and the mind after it."""
    rules = default_reasoners()
    reasoners: tuple[Reasoner, ...] = (*rules.update, *rules.cogitate)
    start = mind.time + 1.0 / FPS if mind.frame_index >= 0 else 0.0
    for observation in drifting_boxes(count, frames, seed, start):
        begin = time.perf_counter()
        mind = replace(
            mind,
            time=observation.time,
            frame_index=observation.frame_index,
            frame_size=observation.frame_size,
        )
        for reasoner in reasoners:
            mind = reasoner(mind, observation).mind
        yield time.perf_counter() - begin, mind

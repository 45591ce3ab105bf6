"""Reasoning for a very long time: time of a step, memory that stays flat, minds that are kept.

Scripted percepts without pictures: boxes that drift, meet, flicker, go over the border and come back
under other ids, called by names that change. What is measured is the reasoners of rules/ alone.
"""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from visup.agent import (
    Health,
    HealthStatus,
    Hypothesis,
    Mind,
    Observation,
    Percept,
    Reasoner,
    Region,
    Report,
    ReportState,
)
from visup.evaluation.figures import Progress, silent
from visup.evaluation.simulation.truth_masks import region_from_mask
from visup.rules.reasoners import default_reasoners

SIZE = (640, 480)
FPS = 25.0
SETTLED = 10_000
"""Frames after which memory is to stay as it is."""

KEPT = 10_000
"""Minds that are kept to learn what one takes."""

_NAMES = ("arm", "satellite", "guitar", "barrel", "drill", "engine")


def evaluate_endurance(
    frames: int, *, seed: int = 0, progress: Progress = silent
) -> dict[str, Any]:
    """Run a script with three objects for so many frames, and one with ten for a tenth of them.

    Args:
        frames: How many.
        seed: Of the script.
        progress: Shows what is being done.

    Returns:
        {"total": {...}, "items": {}}: `ms` and `ms_ten` (median per step), `rss_mb` at the end and
        `grown` (share by which it grew since frame 10,000 or the middle, whichever is earlier), and
        `snapshot_kb` of one of 10,000 minds kept in a row.
    """
    settled = min(SETTLED, frames // 2)
    at_rest, last = 0.0, Mind()
    spent: list[float] = []
    for k, (took, thought) in enumerate(_thought(3, frames, seed, Mind())):
        last = thought
        if k % 16 == 0:
            spent.append(took)
        if k == settled:
            at_rest = resident_mb()
        if k % 5000 == 0:
            progress(f"{k} of {frames} frames")
    end = resident_mb()
    ten = [took for took, _ in _thought(10, max(200, min(frames // 10, 2000)), seed, Mind())]
    before = resident_mb()
    kept = [m for _, m in _thought(3, min(KEPT, frames), seed + 1, last)]
    return {
        "total": {
            "frames": frames,
            "ms": 1000 * float(np.median(spent)),
            "ms_ten": 1000 * float(np.median(ten)),
            "rss_mb": end,
            "grown": end / at_rest - 1.0,
            "snapshot_kb": 1024 * (resident_mb() - before) / len(kept),
        },
        "items": {},
    }


def resident_mb() -> float:
    """Resident memory of this process, MB."""
    try:
        pages = int(Path("/proc/self/statm").read_text().split()[1])
    except OSError:  # not Linux: the most that it ever was
        import resource

        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20


def _thought(count: int, frames: int, seed: int, mind: Mind) -> Iterator[tuple[float, Mind]]:
    """Seconds that each step took, and the mind after it."""
    rules = default_reasoners()
    reasoners: tuple[Reasoner, ...] = (*rules.update, *rules.cogitate)
    start = mind.time + 1.0 / FPS if mind.frame_index >= 0 else 0.0
    for seen in script(count, frames, seed, start):
        begin = time.perf_counter()
        mind = replace(
            mind, time=seen.time, frame_index=seen.frame_index, frame_size=seen.frame_size
        )
        for reasoner in reasoners:
            mind = reasoner(mind, seen).mind
        yield time.perf_counter() - begin, mind


def script(count: int, frames: int, seed: int, start: float = 0.0) -> Iterator[Observation]:
    """Observations of boxes that come and go.

    Args:
        count: How many boxes there are; each in turn is out of the image for a while.
        frames: How many observations.
        seed: Of flicker, jitter and names.
        start: Seconds of the first one.
    """
    rng = np.random.default_rng(seed)
    masks = [np.ones((40 + 4 * k, 60 + 6 * k), dtype=bool) for k in range(count)]
    pace = 20.0 + 7.0 * np.arange(count)
    for index in range(frames):
        now = start + index / FPS
        regions = []
        for k, mask in enumerate(masks):
            span = SIZE[0] + 2 * mask.shape[1]
            lap, along = divmod(pace[k] * now, span)
            x = round(along - mask.shape[1] + rng.normal(0, 0.5))
            y = 20 + round((37 * k) % (SIZE[1] - 120) + 20 * np.sin(now / 3 + k))
            region = _box(1 + k + count * int(lap), mask, x, y)
            if region is not None and rng.random() > 0.1:
                regions.append(region)
        yield _observation(index, now, regions, rng)


def _box(number: int, mask: np.ndarray, x: int, y: int) -> Region | None:
    w = mask.shape[1]
    left, right = max(0, x), min(SIZE[0], x + w)
    if right - left < 4:
        return None
    return region_from_mask(number, mask[:, : right - left], at=(left, y), size=SIZE)


def _observation(
    index: int, now: float, regions: list[Region], rng: np.random.Generator
) -> Observation:
    percepts = [Percept("region", r, now, "script") for r in regions]
    percepts.append(Percept("health", Health(HealthStatus.OK), now, "script"))
    if index % 5 == 0:
        for r in regions:
            own = _NAMES[(r.id - 1) % 3]
            other = _NAMES[int(rng.integers(len(_NAMES)))]
            for name, similarity in ((own, 0.7), (other, 0.65 + 0.1 * rng.random())):
                said = Hypothesis(r.id, name, 0, similarity)
                percepts.append(Percept("hypothesis", said, now, "script"))
    gives = ("region", "health", "hypothesis") if index % 5 == 0 else ("region", "health")
    report = Report("script", ReportState.RAN, gives, tuple(percepts))
    return Observation(index, now, SIZE, (report,))

"""Hours of simulated traffic on several lanes; memory and journal must not grow.

The outlines of cars jitter like those of a segmenter, since this affects the compression of the journal.
Perception is not included: the bounds of its memory have their own tests.
"""

from __future__ import annotations

import gc
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from visup.agent import (
    Health,
    HealthStatus,
    Mind,
    Observation,
    Percept,
    Region,
    Report,
    ReportState,
)
from visup.agent.model.fast_replace import replace
from visup.agent.storage.journal import Journal, segments
from visup.agent.storage.journal_reader import JOURNAL
from visup.agent.storage.jsonable import to_jsonable
from visup.evaluation.figures import Progress, resident_mb, silent
from visup.evaluation.runtime.scripted_observations import FPS, SIZE
from visup.runs.settings import WatchSettings
from visup.runs.wiring import reasoning_agent
from visup.testing import region_of

LANES = 3
CAR_INTERVAL_S = 2.9
"""Seconds from car to car in a lane: some 3,700 an hour in all."""
SPEED = 160.0
"""Pixels per second; each further lane is a fifth faster."""
CAR_SIZE = (72, 40)
OUTLINES = 12
"""Number of outlines of a car, of which one is drawn for each frame."""
BLOCKS = 20
"""Number of memory measurements; the median of each half counts."""


@dataclass(frozen=True, slots=True)
class TrafficCosts:
    """The costs of a run of traffic.

    Attributes:
        memory: Megabytes, by block.
        ms: Milliseconds of processor time per step, by block.
        journal_mb: Size of the whole journal.
        objects: Number of cars.
    """

    memory: Sequence[float]
    ms: Sequence[float]
    journal_mb: float
    objects: int


def evaluate_traffic(hours: float, *, progress: Progress = silent) -> dict[str, Any]:
    """Hours of three lanes of cars at 25 frames a second, with all reasoning and the journal.

    Args:
        hours: Hours of traffic; the run takes about a tenth of that.
        progress: Shows what is being done.

    Returns:
        `items` for the first and the second half with `ms` of a step and `rss_mb`; `total` with `grown`
        (resident memory at the end relative to the middle, minus 1), `journal_mb_per_hour`,
        `objects_per_hour`, `slower` (time of a step in the last block relative to the second).
    """
    with tempfile.TemporaryDirectory() as scratch:
        costs = _run(Path(scratch), int(hours * 3600 * FPS), progress)
    half = len(costs.memory) // 2
    halves = {"first half": slice(0, half), "second half": slice(half, None)}
    items = {
        name: {"ms": float(np.median(costs.ms[part])), "rss_mb": float(costs.memory[part][-1])}
        for name, part in halves.items()
    }
    total = {
        "hours": hours,
        "grown": costs.memory[-1] / costs.memory[half - 1] - 1,
        "journal_mb_per_hour": costs.journal_mb / hours,
        "objects_per_hour": costs.objects / hours,
        "slower": costs.ms[-1] / costs.ms[1],
    }
    return {"items": items, "total": total}


def _run(folder: Path, frames: int, progress: Progress) -> TrafficCosts:
    agent = reasoning_agent(WatchSettings("traffic", preset="traffic"))
    journal = Journal(folder / JOURNAL)
    journal.note(settings=to_jsonable(WatchSettings("traffic", preset="traffic")))
    memory, ms, numbers = list[float](), list[float](), set[int]()
    block, begin = max(1, frames // BLOCKS), time.process_time()
    for observation in traffic(frames):
        step = agent.reason(observation)
        journal.record(step)
        numbers.update(_present_ids(step.mind))
        if (observation.frame_index + 1) % block == 0:
            ms.append((time.process_time() - begin) / block * 1e3)
            gc.collect()
            memory.append(resident_mb())
            progress(f"{observation.frame_index + 1} of {frames} frames, {memory[-1]:.0f} MB")
            begin = time.process_time()
    journal.close()
    size = sum(p.stat().st_size for p in segments(folder / JOURNAL))
    return TrafficCosts(memory, ms, size / 2**20, max(numbers, default=0))


def _present_ids(mind: Mind) -> Iterator[int]:
    return (b.id for b in mind.present())


def traffic(frames: int) -> Iterator[Observation]:
    """Observations of three lanes of cars, each new car with a new id."""
    rng = np.random.default_rng(0)
    masks = _outlines(rng)
    for index in range(frames):
        now = index / FPS
        regions = [r for lane in range(LANES) for r in _lane(lane, now, masks, rng)]
        percepts = [Percept("region", r, now, "traffic") for r in regions]
        percepts.append(Percept("health", Health(HealthStatus.OK), now, "traffic"))
        report = Report("traffic", ReportState.RAN, ("region", "health"), tuple(percepts))
        yield Observation(index, now, SIZE, (report,))


Masks = list[NDArray[np.bool_]]


def _outlines(rng: np.random.Generator) -> Masks:
    """Masks of one car with edges that jitter by a pixel."""
    width, height = CAR_SIZE
    masks = []
    for _ in range(OUTLINES):
        mask = np.zeros((height, width), bool)
        for x in range(width):
            round_off = int(8 * (2 * abs(x / width - 0.5)) ** 4)
            top, bottom = rng.integers(0, 3, 2) + round_off
            mask[top : height - bottom, x] = True
        masks.append(mask)
    return masks


def _lane(lane: int, now: float, masks: Masks, rng: np.random.Generator) -> Iterator[Region]:
    """The visible cars of a lane, the newest last."""
    speed = SPEED * (1 + 0.2 * lane)
    span = (SIZE[0] + CAR_SIZE[0]) / speed
    first, last = int((now - span) // CAR_INTERVAL_S) + 1, int(now // CAR_INTERVAL_S)
    for car in range(max(0, first), last + 1):
        x = round((now - car * CAR_INTERVAL_S) * speed) - CAR_SIZE[0]
        left, right = max(0, x), min(SIZE[0], x + CAR_SIZE[0])
        mask = masks[int(rng.integers(OUTLINES))][:, left - x : right - x]
        if right - left < 4 or not mask.any():
            continue
        number = 1 + lane + LANES * car
        region = region_of(mask, number, (speed, 0.0), at=(left, 60 + 130 * lane), size=SIZE)
        yield replace(region, velocity_sigma=0.5, confidence=0.9)

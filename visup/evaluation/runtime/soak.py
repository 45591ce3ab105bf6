"""A soak test without a camera: scripted percepts, all reasoning, with journal.

Processor time of a step and memory are measured at the beginning and at the end and must not grow. The same
percepts must give the same events, and sinks must cost the cycle almost nothing.
"""

from __future__ import annotations

import hashlib
import tempfile
import time
from array import array
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from visup.agent import (
    Frame,
    Observation,
)
from visup.agent.model.errors import SettingsError
from visup.agent.model.step import Step
from visup.agent.storage.journal import Journal, JournalLimits, segments
from visup.agent.storage.journal_reader import JOURNAL, Recording, export_events
from visup.evaluation.figures import Progress, resident_mb, silent
from visup.evaluation.runtime.scripted_observations import SIZE, moving_ellipses
from visup.runs.replay import replay, settings_for
from visup.runs.settings import WatchSettings
from visup.runs.wiring import reasoning_agent
from visup.sinks import Sinks

MIN_FRAMES = 2000
LIMITS = JournalLimits(segment_bytes=32 * 2**20, keep_bytes=128 * 2**20)
BLOCK_PAIRS = 12  # alternating blocks with and without sinks


def evaluate_soak(frames: int = 200_000, *, progress: Progress = silent) -> dict[str, Any]:
    """Measure a long run.

    Args:
        frames: Its length.
        progress: Shows what is being done.

    Returns:
        `items` for the run's 'start' and 'end' (a tenth of the run each, the first hundredth left out)
        with `ms` (median processor time of a step with its journal) and `rss_mb`; `total` with `frames`,
        `slower` (end by a fresh run that takes turns with it there, since machines are busier at times),
        `rss_grown_mb`, `journal_bytes` for each frame, `disk_mb`, `same` (1 when
        the first `MIN_FRAMES` frames twice gave the same bytes of events), `replay_fps` (frames per
        second of processor time), and `sinks` (time of a step with a file and a webhook that answers
        nobody, by that without).

    Raises:
        SettingsError: There are too few frames.
    """
    if frames < MIN_FRAMES:
        raise SettingsError(f"--frames is {frames}", expected=f"at least {MIN_FRAMES}")
    with tempfile.TemporaryDirectory() as scratch:
        scratch_folder = Path(scratch)
        progress("the same twice")
        digests = [_events_of(scratch_folder / name, MIN_FRAMES) for name in ("once", "twice")]
        replay_fps = _replay_fps(scratch_folder / "once")
        progress("sinks")
        ratio = sinks_ratio(scratch_folder, MIN_FRAMES)
        folder = scratch_folder / "long"
        folder.mkdir()
        costs, fresh_costs, memory = _long_run(folder, frames, progress)
        disk = sum(p.stat().st_size for p in segments(folder / JOURNAL))
    tenth = frames // 10
    start, end = costs[frames // 100 : tenth], costs[-tenth:]
    warm = tenth // 10
    items = {
        "start": {"ms": float(np.median(start)), "rss_mb": memory[0]},
        "end": {"ms": float(np.median(end)), "rss_mb": memory[-1]},
    }
    total = {
        "frames": frames,
        "slower": float(np.median(end[warm:]) / np.median(fresh_costs[warm:])),
        "rss_grown_mb": memory[-1] - memory[0],
        "journal_bytes": _mean_observation_bytes(MIN_FRAMES),
        "disk_mb": disk / 2**20,
        "same": int(digests[0] == digests[1]),
        "replay_fps": replay_fps,
        "sinks": ratio,
    }
    return {"items": items, "total": total}


def _journal(folder: Path, limits: JournalLimits | None = None) -> Journal:
    from visup.agent.storage.jsonable import to_jsonable

    journal = Journal(folder / JOURNAL, limits)
    journal.note(settings=to_jsonable(WatchSettings("scripted", tasks=("dock",))))
    return journal


def _long_run(
    folder: Path, frames: int, progress: Progress
) -> tuple[list[float], list[float], list[float]]:
    """Costs of the steps of a long run, of a fresh run during its last tenth, and memory."""
    long, fresh = _JournaledAgent(folder, LIMITS), None
    last_tenth = frames - frames // 10
    memory: list[float] = []
    for observation in moving_ellipses(frames):
        long.step(observation)
        if observation.frame_index == last_tenth:
            memory.append(resident_mb())
            fresh = _JournaledAgent(folder / "fresh", LIMITS)
        if fresh:
            fresh.step(observation)
        if observation.frame_index == frames // 10:
            memory.append(resident_mb())
        if observation.frame_index % 1000 == 0:
            progress(f"{observation.frame_index} of {frames} frames")
    long.journal.close()
    assert fresh is not None
    fresh.journal.close()
    return long.costs.tolist(), fresh.costs.tolist(), memory


class _JournaledAgent:
    """An agent with its journal, and the costs of its steps, milliseconds of processor time."""

    def __init__(self, folder: Path, limits: JournalLimits) -> None:
        folder.mkdir(exist_ok=True)
        self.agent = reasoning_agent(WatchSettings("scripted", tasks=("dock",)))
        self.journal = _journal(folder, limits)
        self._costs = array("f")

    @property
    def costs(self) -> NDArray[np.float64]:
        return np.asarray(self._costs, np.float64)

    def step(self, observation: Observation) -> None:
        begin = time.process_time()
        self.journal.record(self.agent.reason(observation))
        self._costs.append((time.process_time() - begin) * 1e3)


def _events_of(folder: Path, frames: int) -> str:
    folder.mkdir()
    agent = reasoning_agent(WatchSettings("scripted", tasks=("dock",)))
    journal = _journal(folder)
    for observation in moving_ellipses(frames):
        journal.record(agent.reason(observation))
    journal.close()
    export_events(folder / JOURNAL, folder / "events.jsonl")
    return hashlib.sha256((folder / "events.jsonl").read_bytes()).hexdigest()


def _replay_fps(folder: Path) -> float:
    recording = Recording.open(folder)
    settings = settings_for(recording)
    begin = time.process_time()
    transcript = replay(recording, settings)
    return transcript.steps / (time.process_time() - begin)


def _mean_observation_bytes(frames: int) -> float:
    from visup.agent.storage.codec import pack_observation

    sizes = [len(pack_observation(observation)) for observation in moving_ellipses(frames // 20)]
    return float(np.mean(sizes))


def sinks_ratio(folder: Path, frames: int, also: tuple[str, ...] = ()) -> float:
    """Processor time of the cycle's thread for a step with observers, relative to that without.

    Args:
        folder: A folder for their files.
        frames: Total number of frames.
        also: Further sinks, as in `--sink`.

    Short blocks with and without alternate, so that other load affects both alike.
    """
    destinations = [f"file:{folder / 'alerts.jsonl'}", "webhook:http://127.0.0.1:9/", *also]
    # The webhook answers nobody, and is not waited for: all is measured by then.
    sinks = Sinks(destinations, "scripted", closing_s=0.2)
    block = frames // (2 * BLOCK_PAIRS)
    block_seconds: tuple[list[float], list[float]] = ([], [])
    agent = reasoning_agent(WatchSettings("scripted", tasks=("dock",)))
    blank = Frame(0, 0.0, np.zeros((SIZE[1], SIZE[0], 3), np.uint8))
    for number in range(2 * BLOCK_PAIRS):
        with_sinks = number % 2
        observers: list[Callable[[Step, Frame], None]] = [sinks] if with_sinks else []
        observations = list(moving_ellipses(block, number * block))
        begin = time.perf_counter()
        for observation in observations:
            step = agent.reason(observation)
            for observer in observers:
                observer(step, blank)
        block_seconds[with_sinks].append(time.perf_counter() - begin)
    sinks.close()
    return float(np.percentile(block_seconds[1], 25) / np.percentile(block_seconds[0], 25))

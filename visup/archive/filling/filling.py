"""Fills a lake with the runs of many clips; it can be stopped and restarted at any time."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path

from visup.agent.storage.atomic import write_atomically
from visup.agent.storage.file_lock import acquire_lock
from visup.archive.filling.attempts import forget_interrupted
from visup.archive.filling.piece_queue import CHUNKS
from visup.archive.filling.plan import FailedClip, Plan
from visup.archive.filling.pool import Pool
from visup.archive.filling.watching import WORK, ClipOutcome, Watch, watch_into
from visup.archive.lake import MARK, Lake

RATE = "rate.json"
"""Processing speed of the clips of this lake, for estimates."""


@contextmanager
def only_filler(lake: Lake) -> Iterator[None]:
    """Hold the lock for filling a lake.

    Raises:
        OutputError: Another process is filling it.
    """
    lock = acquire_lock(lake.path / MARK, "this lake")
    try:
        shutil.rmtree(lake.path / WORK, ignore_errors=True)  # left by a killed process
        yield
    finally:
        lock.release()


@dataclass(slots=True)
class FillResult:
    """The result of filling a lake.

    Attributes:
        added: Number of runs added.
        failed: Clips without a run.
        video_s: Seconds of video processed.
        work_s: Seconds of work, summed over the workers.
    """

    added: int = 0
    failed: list[FailedClip] = field(default_factory=list)
    video_s: float = 0.0
    work_s: float = 0.0

    def record(self, outcome: ClipOutcome) -> None:
        """Count one clip."""
        if outcome.failure:
            self.failed.append(outcome.failure)
            return
        self.added += 1
        self.video_s += outcome.video_s
        self.work_s += outcome.wall_s


def fill(
    lake: Lake,
    plan: Plan,
    pool: Pool,
    on_outcome: Callable[[ClipOutcome], None],
    watch: Watch = watch_into,
) -> FillResult:
    """Carry out a plan; the caller holds `only_filler` and has removed old marks.

    Args:
        lake: The lake.
        plan: The missing runs.
        pool: The workers.
        on_outcome: Receives the outcome of each clip.
        watch: Records a clip.
    """
    result = FillResult(failed=list(plan.failed))
    sizes = {job.run: job.bytes for job in plan.jobs}
    rate = read_rate(lake.path)
    try:
        for outcome in pool.outcomes(lake, plan.jobs, watch):
            result.record(outcome)
            if not outcome.failure:
                rate = rate[0] + sizes[outcome.run], rate[1] + outcome.wall_s
            on_outcome(outcome)
        shutil.rmtree(lake.path / CHUNKS, ignore_errors=True)  # left by clips that failed
    finally:
        with suppress(OSError):  # used for estimates only
            known = json.dumps({"bytes": rate[0], "seconds": rate[1]})
            write_atomically(lake.path / RATE, known.encode())
    return result


def clear_attempts(lake: Lake, *, retry: bool) -> None:
    """Remove the marks of clips in progress when filling stopped; with `retry` also of those put aside."""
    forget_interrupted(lake.path, include_failed=retry)


def read_rate(lake: Path) -> tuple[int, float]:
    """Bytes processed so far, and seconds of work for them; (0, 0.0) at first."""
    try:
        rate = json.loads((lake / RATE).read_text(encoding="utf-8"))
        return int(rate["bytes"]), float(rate["seconds"])
    except (OSError, ValueError, KeyError, TypeError):
        return 0, 0.0


def estimated_s(lake: Path, bytes_left: int, workers: int) -> float | None:
    """Estimated seconds for some bytes on some workers; None before the first clip."""
    known, seconds = read_rate(lake)
    return bytes_left * seconds / known / max(1, workers) if known and seconds else None

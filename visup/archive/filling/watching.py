"""Processes one clip on a worker: watch, reason, commit."""

from __future__ import annotations

import os
import shutil
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from visup.agent.execution.runners import error_line
from visup.agent.model.errors import OutputError, VisupError
from visup.agent.storage.journal_reader import Recording
from visup.archive.chunks.extending import chunk_options
from visup.archive.filling.attempts import Attempts
from visup.archive.filling.plan import FailedClip, Job, put_aside
from visup.archive.filling.stores import fetched, note_source
from visup.archive.finding.beliefs import BeliefRecorder
from visup.archive.inputs import run_inputs
from visup.archive.lake import Lake
from visup.archive.run_tables import run_tables
from visup.archive.schema import TABLES
from visup.runs.resume import recorded_settings
from visup.runs.runner import supervise
from visup.runs.settings import RunOptions, WatchSettings

WORK = "work"
"""Folder of a lake for runs in progress."""


@dataclass(frozen=True, slots=True)
class ClipOutcome:
    """The outcome of a job.

    Attributes:
        run: Key of the run.
        source: The clip.
        verdict: Verdict of the run; None without a task or without a run.
        video_s: Seconds of video processed.
        wall_s: Elapsed time, seconds.
        failure: Why there is no run, or None.
    """

    run: str
    source: str
    verdict: str | None = None
    video_s: float = 0.0
    wall_s: float = 0.0
    failure: FailedClip | None = None


Watch = Callable[..., None]
"""Records the run of a source in a folder; a third argument limits it to a span."""


def watch_into(
    settings: WatchSettings, folder: Path, span: tuple[int, int | None] = (0, None)
) -> None:
    """Watch a source and record only the journal of the run.

    Args:
        settings: Settings of the run.
        folder: An existing folder.
        span: The frames; see `VideoSource`.

    Raises:
        VisupError: It cannot be watched, or not recorded completely.
    """
    options = RunOptions(video=False, report=False, state_every_s=0.0)
    if span != (0, None):
        options = chunk_options(*span)
    result = supervise(settings, folder, options=options)
    if not result.recorded:
        raise OutputError(
            "the run could not be recorded whole",
            where=str(folder),
            hint="make room on the disk, and run the command again",
        )


def watch_job(lake: Lake, job: Job, watch: Watch = watch_into) -> ClipOutcome:
    """Watch a clip and commit its run; faults of the clip are part of the outcome and not raised.

    Args:
        lake: The lake.
        job: The job.
        watch: Records a clip.
    """
    start, source = time.monotonic(), job.settings.source
    attempts = Attempts(lake.path, job.run)
    folder = lake.path / WORK / f"{job.run}-{os.getpid()}"
    try:
        if not attempts.begin():
            return ClipOutcome(job.run, source, failure=put_aside(job))
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        settings = fetched(job.settings, folder)
        watch(settings, folder)
        if settings is not job.settings:
            note_source(folder, job.settings)
        verdict, seconds = _committed(lake, job, folder)
    except Exception as fault:
        attempts.clear()
        return ClipOutcome(job.run, source, failure=FailedClip(source, reason_of(fault, source)))
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    attempts.clear()
    return ClipOutcome(job.run, source, verdict, seconds, time.monotonic() - start)


def _committed(lake: Lake, job: Job, folder: Path) -> tuple[str | None, float]:
    """Commit a recorded run; returns its verdict and its seconds of video."""
    recording = Recording.open(folder)
    settings = recorded_settings(recording.facts(), str(recording.path))
    notes = BeliefRecorder()
    tables = run_tables(recording, settings, job.provenance, notes)
    lake.commit(tables, recording, run_inputs(settings), notes.content())
    row = dict(zip(TABLES["runs"].names, tables["runs"][0], strict=True))
    return row["verdict"], row["seconds"]


def reason_of(fault: BaseException, source: str) -> str:
    """Why a clip has no run, without its name, which the caller prints."""
    if isinstance(fault, VisupError):
        return str(fault).removeprefix(f"{source}: ")
    if isinstance(fault, MemoryError):
        return f"there was no memory left ({fault})"
    return f"visup has a fault: {error_line(fault)}"  # the other clips go on

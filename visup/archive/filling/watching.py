"""One clip on a worker: watched, reasoned about, committed."""

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
from visup.archive.finding.beliefs import BeliefNotes
from visup.archive.inputs import run_inputs
from visup.archive.lake import Lake
from visup.archive.run_tables import run_tables
from visup.archive.schema import TABLES
from visup.runs.resume import recorded_settings
from visup.runs.runner import supervise
from visup.runs.settings import RunOptions, WatchSettings

WORK = "work"
"""Folder of a lake in which runs that go on are recorded."""


@dataclass(frozen=True, slots=True)
class ClipOutcome:
    """What became of a job.

    Attributes:
        run: Its key.
        source: The clip.
        verdict: Of the run; None when nothing was to be judged, or there is no run.
        video_s: Seconds of video that were watched.
        wall_s: How long it took.
        failure: Why there is no run, or None.
    """

    run: str
    source: str
    verdict: str | None = None
    video_s: float = 0.0
    wall_s: float = 0.0
    failure: FailedClip | None = None


Watch = Callable[..., None]
"""Watches a source and records the run in a folder; with a third argument only that span of it."""


def watch_into(
    settings: WatchSettings, folder: Path, span: tuple[int, int | None] = (0, None)
) -> None:
    """Watch a source and record the run in a folder: the journal alone.

    Args:
        settings: Of the run.
        folder: A folder that is there.
        span: Which frames; see `VideoSource`.

    Raises:
        VisupError: It cannot be watched, or not all of it could be recorded.
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
    """Watch a clip and commit its run; whatever is wrong with the clip is told, and raises nothing.

    Args:
        lake: Where to.
        job: What.
        watch: How.
    """
    begun, source = time.monotonic(), job.settings.source
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
    return ClipOutcome(job.run, source, verdict, seconds, time.monotonic() - begun)


def _committed(lake: Lake, job: Job, folder: Path) -> tuple[str | None, float]:
    """Put a recorded run into the lake; its verdict and its seconds of video."""
    recording = Recording.open(folder)
    settings = recorded_settings(recording.facts(), str(recording.path))
    notes = BeliefNotes()
    tables = run_tables(recording, settings, job.provenance, notes)
    lake.commit(tables, recording, run_inputs(settings), notes.content())
    row = dict(zip(TABLES["runs"].names, tables["runs"][0], strict=True))
    return row["verdict"], row["seconds"]


def reason_of(fault: BaseException, source: str) -> str:
    """Why a clip has no run, without its name, which is told before."""
    if isinstance(fault, VisupError):
        return str(fault).removeprefix(f"{source}: ")
    if isinstance(fault, MemoryError):
        return f"there was no memory left ({fault})"
    return f"visup has a fault: {error_line(fault)}"  # the others go on

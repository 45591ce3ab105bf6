"""The process of one camera: a run as any other, which tells its supervisor that it is alive.

`python -m visup.serving.camera_process PIPE` reads its job from standard input, which stays open as long as
the supervisor lives: without one it closes its books and ends, so that no camera is watched twice.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
from contextlib import suppress
from pathlib import Path
from typing import BinaryIO

from visup.agent.model.errors import SourceError, VisupError
from visup.agent.storage.file_lock import acquire_lock
from visup.agent.storage.journal_reader import JOURNAL, Recording
from visup.redaction import has_secret
from visup.runs.result import ExitCode, RunResult
from visup.runs.resume import InterruptedRun, interrupted_run
from visup.runs.runner import Audience, fresh_folder, supervise
from visup.serving.reports import CameraJob, ReportKind, ReportPipe, parse_job

CLOSING_S = 10.0
"""How long a run's last process is waited for, seconds."""

BEAT_S = 0.5
"""Seconds between two signs of life."""


class Heartbeat:
    """Tells now and then how far a run has come.

    Args:
        pipe: To the supervisor.
    """

    def __init__(self, pipe: ReportPipe) -> None:
        self._pipe = pipe
        self._last = -BEAT_S

    def __call__(self, done: int, total: int | None, lag_s: float | None = None, /) -> None:
        """Take note of a step."""
        now = time.monotonic()
        if now - self._last >= BEAT_S:
            self._last = now
            self._pipe.send(ReportKind.STEP, steps=done, lag_s=lag_s)


def watch_camera(job: CameraJob, pipe: ReportPipe) -> ExitCode:
    """Do a job to its end; whatever comes of it is told.

    Args:
        job: What to do.
        pipe: To the supervisor.
    """
    audience = Audience(
        progress=Heartbeat(pipe), notice=lambda text: pipe.send(ReportKind.NOTICE, text=text)
    )
    try:
        if job.resume:
            # A process before this one may still close its books.
            acquire_lock(job.folder / JOURNAL, "this run", CLOSING_S).release()
        past = _past(job) if job.resume else None
        folder = job.folder if past else fresh_folder(job.folder, job.settings.source)
        pipe.send(ReportKind.OPENED, resumed=past is not None)
        result = supervise(
            past.settings if past else job.settings,
            folder,
            audience=audience,
            options=job.options,
            past=past,
            at_once=False,
        )
    except VisupError as fault:
        with suppress(OSError):
            job.folder.rmdir()  # what is refused before its first frame leaves no folder behind
        pipe.send(ReportKind.REFUSED, text=str(fault), source=isinstance(fault, SourceError))
        return ExitCode.BAD_INPUT
    _tell(result, folder, pipe)
    return result.exit_code


def _past(job: CameraJob) -> InterruptedRun:
    """The run that goes on, with code and password that the supervisor names."""
    named = job.settings.source if has_secret(job.settings.source) else None
    return interrupted_run(job.folder, job.settings.behaviours, job.settings.plugins, named)


def _tell(result: RunResult, folder: Path, pipe: ReportPipe) -> None:
    pipe.send(
        ReportKind.ENDED,
        live=Recording.open(folder).facts().get("live"),
        verdict=result.verdict.value if result.verdict else None,
        problem=result.problem,
        stopped=result.stopped,
        steps=result.steps,
        notes=list(result.notes),
    )


def _end_with(supervisor: BinaryIO) -> None:
    """Ask this process to end once the supervisor is gone."""
    with suppress(OSError):
        supervisor.read()
    os.kill(os.getpid(), signal.SIGTERM)


def main() -> None:
    """Read the job, and do it."""
    pipe = ReportPipe(int(sys.argv[1]))
    job = parse_job(sys.stdin.buffer.readline())
    reader = threading.Thread(target=_end_with, args=(sys.stdin.buffer,), daemon=True)
    reader.start()
    code = watch_camera(job, pipe)
    sys.stdout.flush()
    # Threads that wait for a camera or a sink must not hold up the end.
    os._exit(code)


if __name__ == "__main__":
    main()

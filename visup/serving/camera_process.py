"""The process of one camera: an ordinary run that reports to its supervisor.

`python -m visup.serving.camera_process PIPE` reads its job from standard input, which stays open as long as
the supervisor lives: when it closes, the process closes its recording and exits, so that no camera is watched
twice. Until a job arrives the process warms up.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
from collections import Counter
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import BinaryIO

import cv2

from visup.agent import Frame
from visup.agent.model.errors import SourceError, VisupError
from visup.agent.model.step import Step
from visup.agent.storage.file_lock import acquire_lock
from visup.agent.storage.journal_reader import JOURNAL, Recording
from visup.redaction import has_secret
from visup.runs.inputs.audience import Audience, RunFigures
from visup.runs.inputs.run_folder import discard_unbegun
from visup.runs.result import ExitCode, RunResult
from visup.runs.resume import InterruptedRun, interrupted_run
from visup.runs.runner import fresh_folder, supervise
from visup.serving.monitoring.camera_figures import PHASE
from visup.serving.reports import CameraJob, ReportKind, ReportPipe, parse_job
from visup.serving.run_store import RunStore
from visup.serving.warm_up import has_job, warm_up

CLOSING_S = 10.0
"""How long to wait for the previous process of a run to close, seconds."""

DELIVERIES = "deliveries.sqlite"
"""In the folder of a camera: alerts that its sinks have not accepted yet."""

HEARTBEAT_S = 0.5
"""Seconds between heartbeats."""


@dataclass(frozen=True, slots=True)
class _ReportingRunStore(RunStore):
    """Folders of further runs; reports each new run to the supervisor."""

    pipe: ReportPipe

    def set_current(self, run: Path) -> None:
        RunStore.set_current(self, run)
        self.pipe.send(ReportKind.ROLLED, run=run.name)


class Heartbeat:
    """Reports the state of a run at intervals: observes its steps and receives its figures after each.

    Args:
        pipe: To the supervisor.
    """

    def __init__(self, pipe: ReportPipe) -> None:
        self._pipe = pipe
        self._last = -HEARTBEAT_S
        self._frames = 0
        self._opened: Counter[str] = Counter()
        self._beliefs: dict[str, int] = {}

    def __call__(self, step: Step, frame: Frame) -> None:
        """Count the frame and the alerts of a step."""
        self._frames += 1
        opened = (a.severity.name.lower() for a in step.alerts if a.closed is None)
        self._opened.update(f"alerts_{severity}" for severity in opened)
        self._beliefs = {
            "objects": len(step.mind.present()),
            "alerts_open": len(step.mind.alerts),
        }

    def beat(self, figures: RunFigures) -> None:
        """Send the counts if a heartbeat is due."""
        now = time.monotonic()
        if now - self._last < HEARTBEAT_S:
            return
        self._last = now
        phases = {PHASE + name: round(ms, 1) for name, ms in figures.phase_ms.items()}
        self._pipe.send(
            ReportKind.STEP,
            steps=figures.steps,
            lag_s=figures.lag_s,
            frames=self._frames,
            dropped=figures.dropped,
            **self._beliefs,
            **self._opened,
            **phases,
        )


def watch_camera(job: CameraJob, pipe: ReportPipe) -> ExitCode:
    """Run a job to its end and report the outcome.

    Args:
        job: The job.
        pipe: To the supervisor.
    """
    if job.threads is not None:
        cv2.setNumThreads(job.threads)
    heartbeat = Heartbeat(pipe)
    audience = Audience(
        observers=(heartbeat,),
        figures=heartbeat.beat,
        folders=_ReportingRunStore(job.folder.parent, job.fingerprint, pipe),
        notice=lambda text: pipe.send(ReportKind.NOTICE, text=text),
    )
    try:
        if job.resume:
            # The previous process may still be closing the recording.
            acquire_lock(job.folder / JOURNAL, "this run", CLOSING_S).release()
        past = _interrupted(job) if job.resume else None
        folder = job.folder if past else fresh_folder(job.folder, job.settings.source)
        pipe.send(ReportKind.OPENED, resumed=past is not None)
        result = supervise(
            past.settings if past else job.settings,
            folder,
            audience=audience,
            options=replace(job.options, deliveries=job.folder.parent / DELIVERIES),
            past=past,
            at_once=False,
        )
    except VisupError as fault:
        discard_unbegun(job.folder)  # a run refused before its first frame leaves no folder
        pipe.send(ReportKind.REFUSED, text=str(fault), source=isinstance(fault, SourceError))
        return ExitCode.BAD_INPUT
    _report_end(result, result.folder or folder, pipe)
    return result.exit_code


def _interrupted(job: CameraJob) -> InterruptedRun:
    """The run to resume, with the code and the password that the supervisor names."""
    source = job.settings.source if has_secret(job.settings.source) else None
    return interrupted_run(job.folder, job.settings.behaviours, job.settings.plugins, source)


def _report_end(result: RunResult, folder: Path, pipe: ReportPipe) -> None:
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
    """Ask this process to end when the supervisor is gone."""
    with suppress(OSError):
        supervisor.read()
    os.kill(os.getpid(), signal.SIGTERM)


def main() -> None:
    """Read the job and run it."""
    pipe = ReportPipe(int(sys.argv[1]))
    if not has_job():
        warm_up(has_job)
    line = sys.stdin.buffer.readline()
    if not line:
        return  # the supervisor is gone, and there was no job
    job = parse_job(line)
    reader = threading.Thread(target=_end_with, args=(sys.stdin.buffer,), daemon=True)
    reader.start()
    code = watch_camera(job, pipe)
    sys.stdout.flush()
    # Threads waiting for a camera or a sink must not delay the exit.
    os._exit(code)


if __name__ == "__main__":
    main()

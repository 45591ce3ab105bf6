"""What a camera's process and its supervisor say to each other: a job, then reports, as lines of JSON."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter

from visup.agent.storage.jsonable import to_jsonable
from visup.runs.settings import RunOptions, WatchSettings

LONGEST_LINE = 4000
"""Bytes of a report: what is shorter than a page goes through a pipe whole or not at all."""


@dataclass(frozen=True, slots=True)
class CameraJob:
    """What a process is to do. It comes by a pipe, so that no password stands in a list of processes.

    Attributes:
        settings: Of the run.
        options: How it is recorded, and where alerts go.
        folder: Of the run.
        resume: Whether the folder holds the run, and it goes on; else a new one is begun.
        fingerprint: As the camera is now; runs that follow go on under the same.
        threads: That OpenCV may use; None for as many as there are cores.
    """

    settings: WatchSettings
    options: RunOptions
    folder: Path
    resume: bool
    fingerprint: str = ""
    threads: int | None = None


class ReportKind(StrEnum):
    """What a process tells."""

    OPENED = "opened"
    """What is needed is there, and the source is opened next; `resumed` says whether the run goes on."""
    STEP = "step"
    """It is alive: `steps`, `lag_s`, and what is counted of it (`monitoring/camera_figures.py`)."""
    NOTICE = "notice"
    """`text`: what cannot wait for a step, such as that the camera dropped."""
    ROLLED = "rolled"
    """The run is followed by another: `run`, its name."""
    ENDED = "ended"
    """The run is over: `verdict`, `steps`, `problem`, `notes`, `stopped`; `live` of a camera."""
    REFUSED = "refused"
    """`text`: it cannot begin; `source` says whether that is because of the source."""


@dataclass(frozen=True, slots=True)
class CameraReport:
    """One line from a process.

    Attributes:
        kind: What it tells.
        data: Its values.
    """

    kind: ReportKind
    data: Mapping[str, Any] = field(default_factory=dict)


def job_line(job: CameraJob) -> bytes:
    """A job as one line."""
    return json.dumps(to_jsonable(job)).encode() + b"\n"


def parse_job(line: bytes) -> CameraJob:
    """The job of a line."""
    return TypeAdapter(CameraJob).validate_json(line)


def report_line(report: CameraReport) -> bytes:
    """A report as one line; texts that are too long are cut."""
    told = {"kind": report.kind.value, **report.data}
    line = json.dumps(told).encode()
    if len(line) > LONGEST_LINE:
        most = LONGEST_LINE // (12 * max(1, len(told)))
        told = {k: v[:most] if isinstance(v, str | list) else v for k, v in told.items()}
        line = json.dumps({k: v for k, v in told.items() if not isinstance(v, list)}).encode()
    return line + b"\n"


def parse_report(line: bytes) -> CameraReport | None:
    """The report of a line; None of what is none."""
    try:
        told = json.loads(line)
        return CameraReport(ReportKind(told.pop("kind")), told)
    except (ValueError, AttributeError, KeyError, TypeError):
        return None


class ReportPipe:
    """The end of a process: a supervisor that does not read holds up nobody.

    Args:
        handle: A pipe to write to.
    """

    def __init__(self, handle: int) -> None:
        os.set_blocking(handle, False)
        self._handle = handle

    def send(self, kind: ReportKind, **data: Any) -> None:
        """Tell something; it is lost when the pipe is full, or nobody listens any more."""
        try:
            os.write(self._handle, report_line(CameraReport(kind, data)))
        except (BlockingIOError, BrokenPipeError):
            return

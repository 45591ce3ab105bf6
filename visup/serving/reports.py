"""The protocol between a camera process and its supervisor: one job, then reports, as lines of JSON."""

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

MAX_LINE_BYTES = 4000
"""Bytes of a report: writes of less than a page (4096 bytes) to a pipe are atomic."""


@dataclass(frozen=True, slots=True)
class CameraJob:
    """The job of a process. It is sent through a pipe, so that no password appears in the list of processes.

    Attributes:
        settings: Settings of the run.
        options: How it is recorded, and where alerts go.
        folder: Folder of the run.
        resume: Whether to resume the run in the folder; otherwise a new one is begun.
        fingerprint: Fingerprint of the camera's settings, also for the runs that follow.
        threads: Number of OpenCV threads; None for one per core.
    """

    settings: WatchSettings
    options: RunOptions
    folder: Path
    resume: bool
    fingerprint: str = ""
    threads: int | None = None


class ReportKind(StrEnum):
    """The kinds of reports."""

    OPENED = "opened"
    """The preparation succeeded and the source is opened next; `resumed` says whether a run is resumed."""
    STEP = "step"
    """Heartbeat: `steps`, `lag_s`, and the figures of `monitoring/camera_figures.py`."""
    NOTICE = "notice"
    """`text`: a message that cannot wait for a step, such as that the camera dropped."""
    ROLLED = "rolled"
    """Another run follows: `run`, its name."""
    ENDED = "ended"
    """The run is over: `verdict`, `steps`, `problem`, `notes`, `stopped`; `live` for a live source."""
    REFUSED = "refused"
    """The run cannot begin: `text` says why, `source` whether the source is the cause."""


@dataclass(frozen=True, slots=True)
class CameraReport:
    """One line from a process.

    Attributes:
        kind: Kind of report.
        data: Its values.
    """

    kind: ReportKind
    data: Mapping[str, Any] = field(default_factory=dict)


def job_line(job: CameraJob) -> bytes:
    """A job as one line."""
    return json.dumps(to_jsonable(job)).encode() + b"\n"


def parse_job(line: bytes) -> CameraJob:
    """Parse a job."""
    return TypeAdapter(CameraJob).validate_json(line)


def report_line(report: CameraReport) -> bytes:
    """A report as one line; overlong texts are cut."""
    fields = {"kind": report.kind.value, **report.data}
    line = json.dumps(fields).encode()
    if len(line) > MAX_LINE_BYTES:
        max_length = MAX_LINE_BYTES // (12 * max(1, len(fields)))
        fields = {k: v[:max_length] if isinstance(v, str | list) else v for k, v in fields.items()}
        line = json.dumps({k: v for k, v in fields.items() if not isinstance(v, list)}).encode()
    return line + b"\n"


def parse_report(line: bytes) -> CameraReport | None:
    """Parse a report; None for a line that is not one."""
    try:
        fields = json.loads(line)
        return CameraReport(ReportKind(fields.pop("kind")), fields)
    except (ValueError, AttributeError, KeyError, TypeError):
        return None


class ReportPipe:
    """The process's end of the report pipe; a supervisor that does not read never blocks it.

    Args:
        handle: File descriptor of the pipe.
    """

    def __init__(self, handle: int) -> None:
        os.set_blocking(handle, False)
        self._handle = handle

    def send(self, kind: ReportKind, **data: Any) -> None:
        """Send a report; it is lost when the pipe is full or closed."""
        try:
            os.write(self._handle, report_line(CameraReport(kind, data)))
        except (BlockingIOError, BrokenPipeError):
            return

"""Cameras and processes that tests make up."""

from __future__ import annotations

import os
import threading
from contextlib import suppress
from pathlib import Path

from visup.runs.settings import RunOptions, WatchSettings
from visup.serving.camera_process import watch_camera
from visup.serving.reports import CameraJob, CameraReport, ReportKind, ReportPipe, parse_report
from visup.serving.site.records import ProcessLimits, SiteCamera
from visup.serving.site_log import SiteEvent


def site_camera(name: str = "cell", source: str = "0", fingerprint: str = "a") -> SiteCamera:
    limits = ProcessLimits(memory_mb=1000.0, silent_s=10.0, start_s=30.0)
    settings = WatchSettings(source=source, patience_s=20.0)
    return SiteCamera(name, settings, RunOptions(video=False, report=False), limits, fingerprint)


class FakeChild:
    """A process that does as a test says."""

    def __init__(self, job: CameraJob) -> None:
        self.job = job
        self.told: list[CameraReport] = []
        self.code: int | None = None
        self.memory: float | None = 100.0
        self.asked = 0
        self.closed = False
        self.stubborn = False

    def tell(self, kind: ReportKind, **data: object) -> None:
        self.told.append(CameraReport(kind, data))

    def reports(self) -> list[CameraReport]:
        told, self.told = self.told, []
        return told

    def exit_code(self) -> int | None:
        return self.code

    def memory_mb(self) -> float | None:
        return self.memory

    def cpu_s(self) -> float | None:
        return None

    def terminate(self) -> None:
        self.asked += 1
        if not self.stubborn and self.code is None:
            self.code = 130

    def kill(self) -> None:
        self.code = -9 if self.code is None else self.code

    def close(self) -> None:
        assert self.code is not None, "it has not ended yet"
        self.closed = True


class ThreadChild(FakeChild):
    """A camera that is watched in a thread: nothing is loaded anew, but no signal reaches it."""

    def __init__(self, job: CameraJob) -> None:
        super().__init__(job)
        self._read, self._write = os.pipe()
        os.set_blocking(self._read, False)
        self._thread = threading.Thread(target=self._watch)
        self._thread.start()

    def _watch(self) -> None:
        code = watch_camera(self.job, ReportPipe(self._write))
        self._thread_code = code

    def reports(self) -> list[CameraReport]:
        with suppress(BlockingIOError):
            lines = os.read(self._read, 2**16).splitlines()
            self.told += [r for line in lines if (r := parse_report(line))]
        return super().reports()

    def exit_code(self) -> int | None:
        if not self._thread.is_alive():
            self.code = int(self._thread_code)
        return self.code

    def close(self) -> None:
        super().close()
        os.close(self._read)
        os.close(self._write)


class Bench:
    """What was begun and told."""

    def __init__(self) -> None:
        self.children: list[FakeChild] = []
        self.lines: list[str] = []
        self.kinds: list[SiteEvent] = []

    def start(self, job: CameraJob) -> FakeChild:
        self.children.append(FakeChild(job))
        return self.children[-1]

    def tell(
        self, camera: str, text: str, kind: SiteEvent = SiteEvent.NOTICE, /, **facts: object
    ) -> None:
        self.lines.append(f"{camera}: {text}")
        self.kinds.append(kind)

    @property
    def running(self) -> list[FakeChild]:
        return [c for c in self.children if c.code is None]

    @property
    def last(self) -> FakeChild:
        return self.children[-1]


def begun_journal(folder: Path) -> None:
    """As a run that was killed leaves it: it can go on."""
    from visup.agent.storage.journal import Journal
    from visup.agent.storage.journal_reader import JOURNAL

    folder.mkdir(parents=True, exist_ok=True)
    if not (folder / JOURNAL).exists():
        Journal(folder / JOURNAL).close()

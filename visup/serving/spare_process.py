"""A process that stands ready: it has loaded all that cameras need, and whoever ends next is followed by it.

To load takes some seconds of a processor, and several times as long where others are at work: the time in
which nobody watches. A spare one has spent it beforehand.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import TYPE_CHECKING

from visup.serving.backoff import Backoff
from visup.serving.camera_child import CameraChild
from visup.serving.reports import CameraJob

if TYPE_CHECKING:
    from visup.serving.site_supervisor import SiteSupervisor

PAUSE_S = 2.0
"""Seconds of calm before a spare one is begun: cameras that have just come back need the processor."""


class SpareProcess:
    """Begins processes of cameras, one of which may stand ready.

    Args:
        begin: Begins a process, given its job or None.
    """

    def __init__(self, begin: Callable[[CameraJob | None], CameraChild] = CameraChild) -> None:
        self._begin = begin
        self._spare: CameraChild | None = None
        self._begun = 0.0
        self._due: float | None = None
        self._backoff = Backoff()

    def start(self, job: CameraJob) -> CameraChild:
        """Begin the process of a job, with the one that stands ready where there is one."""
        spare, self._spare, self._due = self._spare, None, None
        if spare is None or spare.exit_code() is not None:
            if spare:
                spare.close()
            return self._begin(job)
        spare.give(job)
        return spare

    def turn(self, supervisor: SiteSupervisor, now: float) -> None:
        """Have one stand ready as soon as all is calm."""
        if self._spare and self._spare.exit_code() is not None:
            self._spare.close()
            self._spare, self._backoff = None, self._backoff.after(now - self._begun)
            self._due = now + self._backoff.wait_s
        if self._spare or supervisor.over or not supervisor.calm:
            return
        if self._due is None:
            self._due = now + PAUSE_S
        elif now >= self._due:
            self._due, self._begun = None, now
            with suppress(OSError):  # it is tried again; a camera that ends is begun without it
                self._spare = self._begin(None)

    def close(self) -> None:
        """End the one that stands ready."""
        if self._spare:
            self._spare.end()
            self._spare = None

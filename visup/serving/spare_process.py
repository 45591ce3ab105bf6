"""A warmed-up spare process that replaces the next camera process that ends.

Loading takes some seconds of processor time, and several times as long on a busy machine, during which the
camera is not watched. A spare process has loaded everything beforehand.
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

SETTLE_S = 2.0
"""Seconds of calm before a spare process is started: cameras that have just restarted need the processor."""


class SpareProcess:
    """Starts camera processes, using a spare one if it is ready.

    Args:
        begin: Starts a process, given its job or None.
    """

    def __init__(self, start: Callable[[CameraJob | None], CameraChild] = CameraChild) -> None:
        self._start_process = start
        self._spare: CameraChild | None = None
        self._started_at = 0.0
        self._due: float | None = None
        self._backoff = Backoff()

    def start(self, job: CameraJob) -> CameraChild:
        """Start a job, in the spare process if there is one."""
        spare, self._spare, self._due = self._spare, None, None
        if spare is None or spare.exit_code() is not None:
            if spare:
                spare.close()
            return self._start_process(job)
        spare.send_job(job)
        return spare

    def tick(self, supervisor: SiteSupervisor, now: float) -> None:
        """Start a spare process once all cameras are calm."""
        if self._spare and self._spare.exit_code() is not None:
            self._spare.close()
            self._spare, self._backoff = None, self._backoff.after(now - self._started_at)
            self._due = now + self._backoff.wait_s
        if self._spare or supervisor.over or not supervisor.stable:
            return
        if self._due is None:
            self._due = now + SETTLE_S
        elif now >= self._due:
            self._due, self._started_at = None, now
            with suppress(OSError):  # tried again; cameras restart without a spare meanwhile
                self._spare = self._start_process(None)

    def close(self) -> None:
        """End the spare process."""
        if self._spare:
            self._spare.end()
            self._spare = None

"""Supervises all cameras of a site, each with a supervisor of its own; the site file can be reloaded."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from visup.agent.model.errors import OutputError, VisupError
from visup.agent.storage.file_lock import acquire_lock
from visup.percepts.video.waiting_clock import WaitingClock
from visup.runs.inputs.stop_signals import StopRequest
from visup.runs.result import ExitCode
from visup.serving.camera_child import CameraChild
from visup.serving.camera_supervisor import CameraState, CameraSupervisor, Child
from visup.serving.monitoring.status import SiteStatus
from visup.serving.reports import CameraJob
from visup.serving.service_manager import notify_manager
from visup.serving.site.reading import read_site
from visup.serving.site.records import RetentionLimits, Site, SiteConsole
from visup.serving.site_log import SITE, LogEvent, SiteEvent

TICK_S = 0.1
"""Seconds between two turns of all supervisors."""


class SiteSupervisor:
    """The supervisors of all cameras.

    Args:
        site: The site.
        tell: Receives the events.
        start: Starts a process.

    Attributes:
        cameras: The supervisors by name, without cameras that are no longer in the site file.
    """

    def __init__(
        self, site: Site, log_event: LogEvent, start: Callable[[CameraJob], Child] = CameraChild
    ) -> None:
        self._site, self._log_event, self._start = site, log_event, start
        self.cameras = {c.name: self._supervisor(c.name, site) for c in site.cameras}
        self._removed: list[CameraSupervisor] = []
        self._killed_on_close = False

    def tick(self, now: float) -> None:
        """Do what is due for every camera."""
        for camera in (*self.cameras.values(), *self._removed):
            camera.tick(now)
        self._killed_on_close |= any(camera.killed_on_close for camera in self._removed)
        self._removed = [camera for camera in self._removed if camera.state is not CameraState.OVER]

    def reload(self, site: Site, now: float) -> None:
        """Apply a changed site file; cameras that did not change are not touched.

        A camera whose settings changed is asked to end and restarted with the new ones.
        """
        if site.store != self._site.store:
            text = "another store is used after a restart of the service"
            self._log_event(SITE, text, SiteEvent.NOT_RELOADED)
        cameras = {c.name: c for c in site.cameras}
        for name in [n for n in self.cameras if n not in cameras]:
            removed = self.cameras.pop(name)
            removed.stop(now)
            self._removed.append(removed)
        for name, camera in cameras.items():
            if name not in self.cameras:
                self.cameras[name] = self._supervisor(name, site)
            elif self.cameras[name].camera != camera:
                self.cameras[name].replace(camera, now)
        self._site = site

    def stop(self, now: float) -> None:
        """Stop watching all cameras."""
        for one in self.cameras.values():
            one.stop(now)

    def status(self, now: float) -> SiteStatus:
        """The state of the site for monitoring."""
        return SiteStatus(now, tuple(one.status(now) for one in self.cameras.values()))

    @property
    def active_runs(self) -> tuple[Path, ...]:
        """Folders of the runs that are active or will be resumed."""
        supervisors = (*self.cameras.values(), *self._removed)
        return tuple(one.run for one in supervisors if one.run)

    @property
    def limits(self) -> RetentionLimits:
        """The retention limits of the present site file."""
        return self._site.retention

    @property
    def console(self) -> SiteConsole | None:
        """The console of the present site file."""
        return self._site.console

    @property
    def stable(self) -> bool:
        """Whether no camera is starting or closing."""
        return all(one.state in _STABLE_STATES for one in self.cameras.values())

    @property
    def over(self) -> bool:
        """Whether no process is left and none will be started."""
        supervisors = (*self.cameras.values(), *self._removed)
        return all(one.state is CameraState.OVER for one in supervisors)

    @property
    def closed_cleanly(self) -> bool:
        """Whether no process had to be killed when it was asked to end."""
        return not (self._killed_on_close or any(o.killed_on_close for o in self.cameras.values()))

    def _supervisor(self, name: str, site: Site) -> CameraSupervisor:
        (camera,) = (c for c in site.cameras if c.name == name)
        store = self._site.store  # the store does not change during the life of a service
        return CameraSupervisor(
            camera, store, self._log_event, _with_thread_share(self._start, len(site.cameras))
        )


def _with_thread_share(
    start: Callable[[CameraJob], Child], cameras: int
) -> Callable[[CameraJob], Child]:
    """Start cameras with an equal share of the cores each: more threads than cores only cost time."""
    threads = max(1, (os.cpu_count() or 1) // cameras)
    return lambda job: start(replace(job, threads=threads))


_STABLE_STATES = (CameraState.WATCHING, CameraState.OVER)

BackgroundTask = Callable[[SiteSupervisor, float], None]
"""Called at every turn with the time; it must not block, and limits its own rate."""


def serve_site(
    site: Site,
    log_event: LogEvent,
    stop: StopRequest,
    start: Callable[[CameraJob], Child] = CameraChild,
    clock: WaitingClock | None = None,
    background_tasks: Sequence[BackgroundTask] = (),
) -> ExitCode:
    """Watch a site until a stop is requested or every source has ended.

    Args:
        site: The site.
        log_event: Receives the events.
        stop: Stop and reload requests by signals; a reload reads the site file again.
        start: Starts a process.
        clock: Clock of the service.
        background_tasks: Further tasks of every turn.

    Returns:
        `GOOD`, or `NOT_RECORDED` when a process had to be killed as it did not close in time.

    Raises:
        OutputError: The store cannot be written, or another service uses it.
    """
    clock = clock or WaitingClock()
    with _only_service(site.store):
        supervisor = SiteSupervisor(site, log_event, start)
        supervisor.tick(clock.now())
        notify_manager("READY=1")
        stopping = False
        while not supervisor.over:
            if stop.received and not stopping:
                stopping = True
                notify_manager("STOPPING=1")
                supervisor.stop(clock.now())
            if stop.reload and not stopping:
                stop.reload = False
                _reload(supervisor, site.path, log_event, clock.now())
            supervisor.tick(clock.now())
            for task in background_tasks:
                task(supervisor, clock.now())
            notify_manager("WATCHDOG=1")
            clock.wait(TICK_S)
    return ExitCode.GOOD if supervisor.closed_cleanly else ExitCode.NOT_RECORDED


def _reload(supervisor: SiteSupervisor, path: Path, log_event: LogEvent, now: float) -> None:
    try:
        site = read_site(path)
    except VisupError as fault:
        text = f"the site file has mistakes, nothing was changed: {fault}"
        log_event(SITE, text, SiteEvent.NOT_RELOADED)
        return
    log_event(SITE, "the site file was reloaded", SiteEvent.RELOADED)
    supervisor.reload(site, now)


@contextmanager
def _only_service(store: Path) -> Iterator[None]:
    try:
        store.mkdir(parents=True, exist_ok=True)
    except OSError as fault:
        raise OutputError(
            f"the store cannot be written: {fault.strerror}",
            where=str(store),
            hint="choose a folder that you may write to: store = ...",
        ) from fault
    lock = acquire_lock(store / "visup-serve", "the runs of this store")
    try:
        yield
    finally:
        lock.release()

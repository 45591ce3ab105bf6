"""The supervisor of one camera: starts its process, ends it when it hangs or grows too large, restarts it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any, Protocol

from visup.agent.model.errors import VisupError
from visup.serving.backoff import Backoff
from visup.serving.camera_child import CameraChild
from visup.serving.monitoring.camera_figures import CameraFigures
from visup.serving.monitoring.status import CameraStatus
from visup.serving.reports import CameraJob, CameraReport, ReportKind
from visup.serving.run_store import begin_run, resumable_run
from visup.serving.site.records import SiteCamera
from visup.serving.site_log import LogEvent, SiteEvent

TERMINATE_AGAIN_S = 2.5
KILL_AFTER_S = 5.0
"""Seconds after which a process that was asked to end is asked again (it may be waiting for a frame that does
not come), and killed."""

MAX_FAILED_RESUMES = 3
"""After this many failed attempts in a row to resume a run a new one is begun: the saved state may be what
crashes the process."""


class CameraState(StrEnum):
    """The state of a camera's supervision."""

    WAITING = "waiting"
    """Its process starts when the backoff has passed."""
    STARTING = "starting"
    """Its process has made no step yet."""
    WATCHING = "watching"
    CLOSING = "closing"
    """Its process was asked to end."""
    OVER = "over"
    """Its source has ended, or it is no longer watched."""


class Child(Protocol):
    """The part of `CameraChild` that the supervisor uses."""

    def reports(self) -> Sequence[CameraReport]:
        """Reports received since the last call."""
        ...

    def exit_code(self) -> int | None:
        """The exit code, or None."""
        ...

    def memory_mb(self) -> float | None:
        """Memory in use, megabytes, or None."""
        ...

    def cpu_s(self) -> float | None:
        """Processor time used, seconds, or None."""
        ...

    def terminate(self) -> None:
        """Ask it to close its recording and end."""
        ...

    def kill(self) -> None:
        """Kill it."""
        ...

    def close(self) -> None:
        """Release its resources once it has ended."""
        ...


@dataclass(slots=True)
class _Process:
    """One process of the camera; times in seconds of the supervisor's clock."""

    child: Child
    resumed: bool
    started: float
    last_report: float
    first_step: float | None = None
    last_step: float | None = None
    source_lost: bool = False
    terminated_at: float | None = None
    terminated_twice: bool = False
    killed: bool = False
    end: CameraReport | None = None


class CameraSupervisor:
    """Supervises one camera; no method blocks.

    Args:
        camera: The camera.
        store: Folder of all runs.
        tell: Receives the events.
        start: Starts a process.

    Attributes:
        camera: As given; replaced when the site file changes.
        state: The state of its supervision.
        restarts: How often its process was restarted.
        killed_at_close: Whether a process that was asked to end had to be killed.
        figures: Its counters and gauges.
        run: Folder of the run begun or resumed last, or None.
    """

    def __init__(
        self,
        camera: SiteCamera,
        store: Path,
        log_event: LogEvent,
        start: Callable[[CameraJob], Child] = CameraChild,
    ) -> None:
        self.camera = camera
        self.state = CameraState.WAITING
        self.restarts = 0
        self.killed_on_close = False
        self.figures = CameraFigures()
        self.run: Path | None = None
        self._folder = store / camera.name
        self._log_event = log_event
        self._start = start
        self._process: _Process | None = None
        self._start_at = 0.0
        self._backoff = Backoff()
        self._failed_resumes = 0
        self._next_camera: SiteCamera | None = camera

    def tick(self, now: float) -> None:
        """Do what is due; call it several times a second.

        Args:
            now: Seconds of a monotonic clock.
        """
        if self._process:
            self._read_reports(self._process, now)
            self._enforce_limits(self._process, now)
            if (code := self._process.child.exit_code()) is not None:
                self._process_ended(self._process, code, now)
        elif self.state is CameraState.WAITING and now >= self._start_at:
            self._start_process(now)

    def replace(self, camera: SiteCamera, now: float) -> None:
        """Change the settings: the process is asked to end and restarted with the new ones."""
        self._next_camera, self.camera = camera, camera
        self._start_at, self._backoff, self._failed_resumes = now, Backoff(), 0
        if self._process:
            self._terminate(self._process, now)
        else:
            self.state = CameraState.WAITING

    def stop(self, now: float) -> None:
        """Stop watching; `state` is OVER once the process has ended."""
        self._next_camera = None
        if self._process:
            self._terminate(self._process, now)
        else:
            self.state = CameraState.OVER

    def status(self, now: float) -> CameraStatus:
        """The state of the camera for monitoring."""
        process = self._process
        self.figures.update({"cpu_s": process.child.cpu_s()} if process else {})
        step_age_s = (
            None if process is None or process.last_step is None else now - process.last_step
        )
        return CameraStatus(
            self.camera.name,
            self.state.value,
            self.restarts,
            process.child.memory_mb() if process else None,
            step_age_s,
            self.figures.totals,
            dict(self.figures.latest),
        )

    def _report_event(self, text: str, kind: SiteEvent, **facts: Any) -> None:
        self._log_event(self.camera.name, text, kind, **facts)

    def _start_process(self, now: float) -> None:
        camera = self.camera
        try:
            run = (
                resumable_run(self._folder, camera.fingerprint)
                if self._failed_resumes < MAX_FAILED_RESUMES
                else None
            )
            folder = run or begin_run(self._folder, camera.fingerprint)
            job = CameraJob(
                camera.settings,
                camera.options,
                folder,
                resume=run is not None,
                fingerprint=camera.fingerprint,
            )
            child = self._start(job)
        except (VisupError, OSError) as fault:
            self._backoff = self._backoff.after(0.0)
            self._start_at = now + self._backoff.wait_s
            self._report_event(
                f"it cannot be started: {fault}; next try in {self._backoff.wait_s:g} s",
                SiteEvent.NOT_BEGUN,
            )
            return
        self.run = folder
        self._process = _Process(child, run is not None, now, now)
        self.state = CameraState.STARTING
        action, kind = ("resumes", SiteEvent.RESUMED) if run else ("starts", SiteEvent.BEGUN)
        self._report_event(f"{action} run {folder.name}", kind, run=folder.name)

    def _read_reports(self, process: _Process, now: float) -> None:
        for report in process.child.reports():
            process.last_report = now
            if report.kind is ReportKind.STEP:
                process.source_lost, process.last_step = False, now
                self.figures.update(report.data)
                if process.first_step is None:
                    process.first_step, self._failed_resumes = now, 0
                    if self.state is CameraState.STARTING:
                        self.state = CameraState.WATCHING
            elif report.kind is ReportKind.NOTICE:
                process.source_lost = True
                self._report_event(_text(report.data.get("text")), SiteEvent.NOTICE)
            elif report.kind is ReportKind.ROLLED:
                run = Path(_text(report.data.get("run"))).name
                self.run = self._folder / run
                self._report_event(f"continues in run {run}", SiteEvent.ROLLED, run=run)
            elif report.kind in (ReportKind.ENDED, ReportKind.REFUSED):
                process.end = report

    def _enforce_limits(self, process: _Process, now: float) -> None:
        """End a process that is silent for too long or uses too much memory."""
        limits = self.camera.limits
        if process.terminated_at is not None:
            self._close(process, now - process.terminated_at)
            return
        extra_s = self.camera.settings.patience_s if process.source_lost else 0.0
        max_silence_s = limits.start_s if process.first_step is None else limits.silent_s + extra_s
        memory = process.child.memory_mb()
        if now - process.last_report > max_silence_s:
            self._report_event(
                f"no sign of life for {now - process.last_report:.0f} s: its process is killed",
                SiteEvent.HUNG,
            )
            process.child.kill()
            process.last_report, process.killed = now, True
        elif memory is not None and memory > limits.memory_mb:
            self._report_event(
                f"{memory:.0f} MB in use, {limits.memory_mb:.0f} allowed: its process is restarted",
                SiteEvent.TOO_LARGE,
                memory_mb=round(memory),
            )
            self._terminate(process, now)

    def _close(self, process: _Process, waited_s: float) -> None:
        if waited_s > KILL_AFTER_S and not process.killed:
            process.killed = self.killed_on_close = True
            self._report_event(
                f"its process did not close within {KILL_AFTER_S:g} s and is killed",
                SiteEvent.NOT_CLOSED,
            )
            process.child.kill()
        elif waited_s > TERMINATE_AGAIN_S and not process.terminated_twice:
            process.terminated_twice = True
            process.child.terminate()

    def _terminate(self, process: _Process, now: float) -> None:
        if process.terminated_at is None:
            process.terminated_at = now
            process.child.terminate()
        self.state = CameraState.CLOSING

    def _process_ended(self, process: _Process, code: int, now: float) -> None:
        self._read_reports(process, now)  # reports sent before it ended
        process.child.close()
        self.figures.process_ended()
        self._process = None
        terminated_at = process.terminated_at is not None
        if self._next_camera is None or (not terminated_at and self._source_ended(process)):
            self.state = CameraState.OVER
            text = _end_text(
                process, "it is no longer watched" if self._next_camera is None else ""
            )
            self._report_event(text, SiteEvent.ENDED)
            return
        self.state = CameraState.WAITING
        if terminated_at:
            self._report_event(_end_text(process, "it is restarted"), SiteEvent.ENDED)
            return
        self._count(process, now)
        self._start_at = now + self._backoff.wait_s
        self.restarts += 1
        cause = _end_text(process, "") if process.end else _exit_text(code, killed=process.killed)
        restart_text = f"{cause}; restarting in {self._backoff.wait_s:g} s"
        self._report_event(
            restart_text, SiteEvent.DIED, exit_code=code, wait_s=self._backoff.wait_s
        )

    def _count(self, process: _Process, now: float) -> None:
        """Update the backoff and the count of failed attempts to resume after an end."""
        ran_s = 0.0 if process.first_step is None else now - process.first_step
        self._backoff = self._backoff.after(ran_s)
        if not process.resumed or process.first_step is not None:
            self._failed_resumes = 0
        elif process.end and process.end.kind is ReportKind.REFUSED:
            # A run that is refused will be refused again; a camera that is not reachable may come back.
            self._failed_resumes = 0 if process.end.data.get("source") else MAX_FAILED_RESUMES
        else:
            self._failed_resumes += 1

    def _source_ended(self, process: _Process) -> bool:
        """Whether the source is a file that was played to its end."""
        end = process.end
        return bool(end and end.kind is ReportKind.ENDED and end.data.get("live") is False)


def _end_text(process: _Process, consequence: str) -> str:
    end = process.end
    if end is None:
        return consequence or "it is over"
    if end.kind is ReportKind.REFUSED:
        text = f"it cannot be watched: {_text(end.data.get('text'))}"
    else:
        # Who asked it to stop is the service itself, whose reason is the consequence.
        problem = None if end.data.get("stopped") and consequence else end.data.get("problem")
        text = f"verdict {end.data.get('verdict') or 'none'} after {end.data.get('steps')} frames"
        text += f" ({_text(problem)})" if problem else ""
    return f"{text}; {consequence}" if consequence else text


def _exit_text(code: int, *, killed: bool) -> str:
    if killed:
        return "its process was killed"
    return (
        f"its process died (signal {-code})" if code < 0 else f"its process died (exit code {code})"
    )


def _text(value: Any) -> str:
    """A text of the process on one line."""
    return "; ".join(part.strip() for part in str(value).splitlines())

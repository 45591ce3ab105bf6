"""One camera for months: its process is begun, watched, ended when it hangs or swells, and begun again."""

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
from visup.serving.run_store import begin_run, run_under_way
from visup.serving.site.records import SiteCamera
from visup.serving.site_log import SiteEvent, Tell

ASK_AGAIN_S = 2.5
CLOSE_S = 5.0
"""A process that was asked to end is asked again after the one (it may wait for a frame that does not come),
and killed after the other, seconds."""

MOST_VAIN = 3
"""A run that cannot be taken up so many times in a row is left, and a new one begun: its state may be what
ends the process."""


class CameraState(StrEnum):
    """What is done with a camera now."""

    WAITING = "waiting"
    """It is begun when its time has come."""
    STARTING = "starting"
    """Its process has not made a step yet."""
    WATCHING = "watching"
    CLOSING = "closing"
    """Its process was asked to end."""
    OVER = "over"
    """Its source was seen to the end, or it is watched no more."""


class Child(Protocol):
    """What is used of a process; see `CameraChild`."""

    def reports(self) -> Sequence[CameraReport]:
        """What it told since it was last asked."""
        ...

    def exit_code(self) -> int | None:
        """With what it ended, or None."""
        ...

    def memory_mb(self) -> float | None:
        """Memory in use, megabytes, or None."""
        ...

    def cpu_s(self) -> float | None:
        """Processor time used, seconds, or None."""
        ...

    def ask_to_end(self) -> None:
        """Let it close its books."""
        ...

    def kill(self) -> None:
        """End it at once."""
        ...

    def close(self) -> None:
        """Let go of it once it has ended."""
        ...


@dataclass(slots=True)
class _Life:
    """One process, from its beginning to its end."""

    child: Child
    resumed: bool
    begun: float
    heard: float
    first_step: float | None = None
    last_step: float | None = None
    away: bool = False
    asked: float | None = None
    asked_again: bool = False
    killed: bool = False
    end: CameraReport | None = None


class CameraSupervisor:
    """Watches over one camera; nothing here waits.

    Args:
        camera: Which.
        store: Folder of all runs.
        tell: Told what happens.
        start: Begins a process.

    Attributes:
        camera: As given; replaced when the site file changes.
        state: What is done with it now.
        restarts: How often its process was begun again.
        killed_at_close: Whether a process that was asked to end had to be killed.
        figures: What is counted of it.
        run: Folder of the run that was begun or taken up last, or None.
    """

    def __init__(
        self,
        camera: SiteCamera,
        store: Path,
        tell: Tell,
        start: Callable[[CameraJob], Child] = CameraChild,
    ) -> None:
        self.camera = camera
        self.state = CameraState.WAITING
        self.restarts = 0
        self.killed_at_close = False
        self.figures = CameraFigures()
        self.run: Path | None = None
        self._folder = store / camera.name
        self._say = tell
        self._start = start
        self._life: _Life | None = None
        self._due = 0.0
        self._backoff = Backoff()
        self._vain = 0
        self._then: SiteCamera | None = camera

    def turn(self, now: float) -> None:
        """See to it once; several times a second is right.

        Args:
            now: Seconds from any start, never going back.
        """
        if self._life:
            self._listen(self._life, now)
            self._limit(self._life, now)
            if (code := self._life.child.exit_code()) is not None:
                self._ended(self._life, code, now)
        elif self.state is CameraState.WAITING and now >= self._due:
            self._begin(now)

    def replace(self, camera: SiteCamera, now: float) -> None:
        """Go on with other settings: its process ends in good order, and is begun with these."""
        self._then, self.camera = camera, camera
        self._due, self._backoff, self._vain = now, Backoff(), 0
        if self._life:
            self._ask(self._life, now)
        else:
            self.state = CameraState.WAITING

    def stop(self, now: float) -> None:
        """Watch it no more; `state` is OVER once its process has ended."""
        self._then = None
        if self._life:
            self._ask(self._life, now)
        else:
            self.state = CameraState.OVER

    def status(self, now: float) -> CameraStatus:
        """What is told of it to those who ask from outside."""
        life = self._life
        self.figures.take({"cpu_s": life.child.cpu_s()} if life else {})
        stepped = None if life is None or life.last_step is None else now - life.last_step
        return CameraStatus(
            self.camera.name,
            self.state.value,
            self.restarts,
            life.child.memory_mb() if life else None,
            stepped,
            self.figures.totals,
            dict(self.figures.latest),
        )

    def _tell(self, text: str, kind: SiteEvent, **facts: Any) -> None:
        self._say(self.camera.name, text, kind, **facts)

    def _begin(self, now: float) -> None:
        camera = self.camera
        try:
            run = (
                run_under_way(self._folder, camera.fingerprint) if self._vain < MOST_VAIN else None
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
            self._due = now + self._backoff.wait_s
            self._tell(
                f"it cannot be started: {fault}; next try in {self._backoff.wait_s:g} s",
                SiteEvent.NOT_BEGUN,
            )
            return
        self.run = folder
        self._life = _Life(child, run is not None, now, now)
        self.state = CameraState.STARTING
        verb, kind = ("resumes", SiteEvent.RESUMED) if run else ("starts", SiteEvent.BEGUN)
        self._tell(f"{verb} run {folder.name}", kind, run=folder.name)

    def _listen(self, life: _Life, now: float) -> None:
        for report in life.child.reports():
            life.heard = now
            if report.kind is ReportKind.STEP:
                life.away, life.last_step = False, now
                self.figures.take(report.data)
                if life.first_step is None:
                    life.first_step, self._vain = now, 0
                    if self.state is CameraState.STARTING:
                        self.state = CameraState.WATCHING
            elif report.kind is ReportKind.NOTICE:
                life.away = True
                self._tell(_text(report.data.get("text")), SiteEvent.NOTICE)
            elif report.kind is ReportKind.ROLLED:
                run = Path(_text(report.data.get("run"))).name
                self.run = self._folder / run
                self._tell(f"continues in run {run}", SiteEvent.ROLLED, run=run)
            elif report.kind in (ReportKind.ENDED, ReportKind.REFUSED):
                life.end = report

    def _limit(self, life: _Life, now: float) -> None:
        """End a process that takes too long or too much."""
        limits = self.camera.limits
        if life.asked is not None:
            self._close(life, now - life.asked)
            return
        patience = self.camera.settings.patience_s if life.away else 0.0
        most = limits.start_s if life.first_step is None else limits.silent_s + patience
        memory = life.child.memory_mb()
        if now - life.heard > most:
            self._tell(
                f"no sign of life for {now - life.heard:.0f} s: its process is killed",
                SiteEvent.HUNG,
            )
            life.child.kill()
            life.heard, life.killed = now, True
        elif memory is not None and memory > limits.memory_mb:
            self._tell(
                f"{memory:.0f} MB in use, {limits.memory_mb:.0f} allowed: its process is restarted",
                SiteEvent.TOO_LARGE,
                memory_mb=round(memory),
            )
            self._ask(life, now)

    def _close(self, life: _Life, waited: float) -> None:
        if waited > CLOSE_S and not life.killed:
            life.killed = self.killed_at_close = True
            self._tell(
                f"its process did not close within {CLOSE_S:g} s and is killed",
                SiteEvent.NOT_CLOSED,
            )
            life.child.kill()
        elif waited > ASK_AGAIN_S and not life.asked_again:
            life.asked_again = True
            life.child.ask_to_end()

    def _ask(self, life: _Life, now: float) -> None:
        if life.asked is None:
            life.asked = now
            life.child.ask_to_end()
        self.state = CameraState.CLOSING

    def _ended(self, life: _Life, code: int, now: float) -> None:
        self._listen(life, now)  # its last words
        life.child.close()
        self.figures.process_ended()
        self._life = None
        asked = life.asked is not None
        if self._then is None or (not asked and self._seen_whole(life)):
            self.state = CameraState.OVER
            words = _last_words(life, "it is no longer watched" if self._then is None else "")
            self._tell(words, SiteEvent.ENDED)
            return
        self.state = CameraState.WAITING
        if asked:
            self._tell(_last_words(life, "it is restarted"), SiteEvent.ENDED)
            return
        self._count(life, now)
        self._due = now + self._backoff.wait_s
        self.restarts += 1
        why = _last_words(life, "") if life.end else _how(code, killed=life.killed)
        again = f"{why}; restarting in {self._backoff.wait_s:g} s"
        self._tell(again, SiteEvent.DIED, exit_code=code, wait_s=self._backoff.wait_s)

    def _count(self, life: _Life, now: float) -> None:
        """What an end says of the next beginning."""
        ran = 0.0 if life.first_step is None else now - life.first_step
        self._backoff = self._backoff.after(ran)
        if not life.resumed or life.first_step is not None:
            self._vain = 0
        elif life.end and life.end.kind is ReportKind.REFUSED:
            # The run itself is refused, and will be again; a camera that is not there may come back.
            self._vain = 0 if life.end.data.get("source") else MOST_VAIN
        else:
            self._vain += 1

    def _seen_whole(self, life: _Life) -> bool:
        """Whether there is nothing more to see: a file, to its end."""
        end = life.end
        return bool(end and end.kind is ReportKind.ENDED and end.data.get("live") is False)


def _last_words(life: _Life, then: str) -> str:
    end = life.end
    if end is None:
        return then or "it is over"
    if end.kind is ReportKind.REFUSED:
        said = f"it cannot be watched: {_text(end.data.get('text'))}"
    else:
        problem = end.data.get("problem")
        said = f"verdict {end.data.get('verdict') or 'none'} after {end.data.get('steps')} frames"
        said += f" ({_text(problem)})" if problem else ""
    return f"{said}; {then}" if then else said


def _how(code: int, *, killed: bool) -> str:
    if killed:
        return "its process was killed"
    return (
        f"its process died (signal {-code})" if code < 0 else f"its process died (exit code {code})"
    )


def _text(value: Any) -> str:
    """Words of a process, on one line."""
    return "; ".join(part.strip() for part in str(value).splitlines())

"""`visup.watch`: watch a source step by step."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from itertools import islice
from pathlib import Path
from types import TracebackType
from typing import Self, Unpack

from rich.console import RenderableType

from visup.agent.cycle.system_alerts import grave_kinds, verdict_without_task
from visup.agent.model.errors import SettingsError
from visup.agent.model.events import Alert, Event
from visup.agent.model.fast_replace import replace
from visup.agent.model.records import Frame
from visup.agent.model.step import Step
from visup.agent.model.task_beliefs import Verdict
from visup.api.display import html_with_picture, run_summary, with_picture
from visup.api.records import Records
from visup.api.watch_options import TaskLike, WatchOptions, settings_from
from visup.narrative import Narrative
from visup.percepts.shape.database.model_database import ModelDatabase
from visup.redaction import redacted
from visup.runs.result import RunResult
from visup.runs.runner import Audience, fresh_folder, supervised
from visup.runs.settings import WatchSettings
from visup.runs.wiring import final_verdict

MAX_STEPS = 2000
"""Steps that a run keeps in memory, about 100 kB each; all events and alerts are kept."""


def watch(
    source: str | int | os.PathLike[str] | WatchSettings,
    *,
    task: TaskLike | Sequence[TaskLike] | None = None,
    models: str | os.PathLike[str] | ModelDatabase | None = None,
    actors: Mapping[str, str | Sequence[str]] | None = None,
    out: str | os.PathLike[str] | None = None,
    **options: Unpack[WatchOptions],
) -> Run:
    """Supervise a source: segment motion, recognise objects, evaluate rules, verify tasks.

    The run advances as you iterate over it; asking for `verdict`, `events` and so on before that
    watches the source to its end.

    Example:
        ```python
        run = visup.watch("clip.mp4", task="dock", models="things.models", actors={"arm": "arm"})
        for step in run:
            print(step.time, [event.text for event in step.events])
        print(run.verdict)
        ```

    Args:
        source: A video file, a folder of images, a URL, the number of a camera, or a complete `Settings`
            (then only `out` can be given with it).
        task: A task file, the name of a shipped task, a task from `visup.load_task`, or several;
            None to supervise by the safety rules only.
        models: A model database, or None to work without identities.
        actors: Actor of the task -> its model or models.
        out: Folder to record to: journal, events, annotated video, report. None records nothing.
        options: Further settings, named as in `visup.Settings`.

    Returns:
        The run, before its first step.

    Raises:
        VisupError: An argument is invalid; the message says what was expected.
    """
    if not isinstance(source, WatchSettings):
        return Run(settings_from(source, task, models, actors, options), out)
    if options or not (task is None and models is None and actors is None):
        raise SettingsError(
            "a Settings object is complete: only `out` can be given with it",
            hint="change them with dataclasses.replace(settings, ...)",
        )
    return Run(source, out)


class Run(Iterator[Step]):
    """A supervised source; iterate over it for one step after another.

    Each step that it yields carries its frame, so that `step.draw()` shows it. In a `with` statement
    a run that is left early is closed properly, with its report.

    Args:
        settings: What to watch, and what for.
        out: Folder to record to, or None.

    Attributes:
        settings: As given.
        result: How the run ended, with the recorded folder and report; None until then.
    """

    def __init__(self, settings: WatchSettings, out: str | os.PathLike[str] | None = None) -> None:
        self.settings = settings
        self.result: RunResult | None = None
        self._steps: deque[Step] = deque(maxlen=MAX_STEPS)
        self._events: list[Event] = []
        self._alerts: dict[int, Alert] = {}
        self._frame: Frame | None = None
        self._started = False
        folder = fresh_folder(Path(out), settings.source) if out is not None else None
        self._run = supervised(settings, folder, Audience((self._store,)))

    def __next__(self) -> Step:
        self._started = True
        try:
            step = next(self._run)
        except StopIteration as end:
            self._end(end)
            raise
        return replace(step, frame=self._frame)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.stop()

    def __repr__(self) -> str:
        state = "ended" if self.result else "under way" if self._started else "not started"
        return f"Run({redacted(self.settings.source)!r}, {state}, {len(self._events)} events)"

    def __rich__(self) -> RenderableType:
        return with_picture(self._summary(), self._last_step())

    def _repr_html_(self) -> str:
        return html_with_picture(self._summary(), self._last_step())

    def narrate(self) -> Iterator[Event]:
        """Watch the rest of the source, and yield notable events as they come.

        These are the lines that `visup watch` prints: events with one cause are one line, and an
        unidentified object gets a single line. `events` has all events.
        """
        narrative = Narrative()
        for step in self:
            yield from narrative.lines(step, step.frame)
        if self._steps:
            yield from narrative.rest(self._steps[-1].time, self._steps[-1].frame_index)

    def finish(self) -> Self:
        """Watch the rest of the source, and return the run itself."""
        for _ in self:
            pass
        return self

    def stop(self) -> Self:
        """End the run here; the verdict and the recording cover what was seen so far."""
        if self.result is None and self._started:
            try:
                self._run.throw(KeyboardInterrupt())
            except StopIteration as end:
                self._end(end)
        return self

    @property
    def steps(self) -> Records[Step]:
        """The steps so far, the latest `MAX_STEPS` of them; the last one carries its frame."""
        self._finish_unless_started()
        last = self._last_step()
        return Records(Step, [*islice(self._steps, len(self._steps) - 1), last] if last else ())

    @property
    def events(self) -> Records[Event]:
        """The events so far, in order."""
        self._finish_unless_started()
        return Records(Event, self._events)

    @property
    def alerts(self) -> Records[Alert]:
        """All alerts so far in their current state, in the order in which they opened."""
        self._finish_unless_started()
        return Records(Alert, [self._alerts[i] for i in sorted(self._alerts)])

    @property
    def verdict(self) -> Verdict | None:
        """The verdict so far, or the final one; None if there was no task and nothing was wrong."""
        self._finish_unless_started()
        if self.result is not None:
            return self.result.verdict
        return self._verdict_so_far()

    def _finish_unless_started(self) -> None:
        """Watch the whole source if results are asked for before the first step."""
        if not self._started:
            self.finish()

    def _last_step(self) -> Step | None:
        return replace(self._steps[-1], frame=self._frame) if self._steps else None

    def _summary(self) -> RenderableType:
        state = (
            "" if self.result else "; the run is under way" if self._started else "; not started"
        )
        verdict = self.result.verdict if self.result else self._verdict_so_far()
        return run_summary(
            f"{redacted(self.settings.source)}{state}",
            self._events,
            verdict,
            has_task=bool(self.settings.tasks),
        )

    def _store(self, step: Step, frame: Frame) -> None:
        self._frame = frame
        self._steps.append(step)
        self._events += step.events
        self._alerts |= {a.id: a for a in step.alerts}

    def _end(self, end: StopIteration) -> None:
        # A generator that has ended ends again, without its value, whenever it is asked.
        self.result = self.result or end.value

    def _verdict_so_far(self) -> Verdict | None:
        if not self._steps:
            return None
        mind = self._steps[-1].mind
        if mind.tasks:
            return final_verdict(mind)
        return verdict_without_task(grave_kinds(self._events))

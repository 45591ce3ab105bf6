"""Writes the run folder: the journal during the run, and derived files at the end.

A journal that cannot be written (full disk, removed folder) does not stop the supervision: steps wait in
memory, an alert reports the fault, and writing is retried.
"""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any

from visup.agent import AlertCondition, Frame, Severity, TaskBelief
from visup.agent.cycle.system_alerts import NOT_RECORDED
from visup.agent.model.errors import ExtraMissingError, OutputError
from visup.agent.model.step import Step
from visup.agent.storage.journal import Journal, JournalLimits
from visup.agent.storage.journal_reader import JOURNAL, export_events
from visup.agent.storage.jsonable import to_jsonable
from visup.agent.storage.wall_clock import RecordStamp, WallClock
from visup.percepts.video import VideoSource
from visup.redaction import has_secret, redacted
from visup.runs.settings import SOURCE_REDACTED, RunOptions, WatchSettings
from visup.tasks import load_tasks
from visup.tasks.tools.outline import outline
from visup.version import __version__

if TYPE_CHECKING:
    from visup.report.records import RunData
    from visup.runs.result import RunResult

MAX_WAITING_STEPS = 1000
"""Steps that wait while the journal cannot be written; beyond this number the oldest are lost."""

RETRY_STEPS = 25
"""Steps between two retries."""


class Recorder:
    """Writes the journal, the annotated video and the report of a run; an observer.

    Args:
        settings: Settings of the run.
        source: The source.
        folder: A folder from `fresh_folder`, or that of the run to resume.
        options: What to write.
        resume: Whether a run is resumed.

    Attributes:
        folder: As given.
        journal: The journal.
        facts: Facts about the run.
        notes: Notes for the user.
        complete: Whether everything so far was written, apart from the annotated video.

    Raises:
        OutputError: The journal cannot be created.
    """

    def __init__(
        self,
        settings: WatchSettings,
        source: VideoSource,
        folder: Path,
        options: RunOptions,
        *,
        resume: bool = False,
    ) -> None:
        from visup.report.collector import Collector
        from visup.report.video import AnnotatedVideo

        self.folder = folder
        keep_bytes = None if options.keep_gb is None else int(options.keep_gb * 1e9)
        limits = JournalLimits(keep_bytes=keep_bytes, reserve_bytes=options.reserve_bytes)
        self.journal = Journal(folder / JOURNAL, limits, resume=resume)
        self.facts = {**_facts(settings, source), **RecordStamp(options.camera).named}
        if not resume:
            self.journal.note(**self.facts)
        self.notes = source.notes
        self.complete = True
        self.collector = Collector()
        self._task_trees = [outline(t) for name in settings.tasks for t in load_tasks(name)]
        path = free_path(folder / "annotated.webm")
        self.video = AnnotatedVideo(path, source.fps / source.every) if options.video else None
        self._wants_report = options.report
        self._derived = {"report": self.collector.add} if options.report else {}
        if self.video:
            self._derived["annotated video"] = self.video.add
        self._waiting: deque[Step] = deque(maxlen=MAX_WAITING_STEPS)
        self._steps_to_retry = 0
        self._lost = 0
        self._clock: WallClock | None = None
        self._wall = WallClock()
        self._fault = ""

    def __call__(self, step: Step, frame: Frame) -> None:
        """Record one step."""
        self._lost += len(self._waiting) == MAX_WAITING_STEPS
        self._waiting.append(step)
        self._steps_to_retry -= 1
        if self._steps_to_retry <= 0:
            self._write()
        self._derive(step, frame, list(self._derived))

    @property
    def behind(self) -> bool:
        """Whether steps are waiting to be written."""
        return bool(self._waiting)

    def record_clock(self, clock: WallClock) -> None:
        """Record the wall clock with the next step."""
        self._clock = self._wall = clock
        self.facts["began"] = clock.text(0.0)

    def restart_report(self) -> None:
        """Clear the data for the report, since all steps will be processed again."""
        from visup.report.collector import Collector

        self.collector = Collector()
        if "report" in self._derived:
            self._derived["report"] = self.collector.add

    def catch_up(self, step: Step, frame: Frame) -> None:
        """Process a step that is already in the journal."""
        self._derive(step, frame, ["report"])

    def runtime_faults(self) -> Iterable[AlertCondition]:
        """Present faults of recording."""
        if self._fault:
            lost = f"{self._lost} steps are lost." if self._lost else "Nothing is lost so far."
            yield AlertCondition(
                NOT_RECORDED,
                (),
                Severity.WARNING,
                "The run is not being recorded; supervision goes on.",
                (self._fault, lost),
                needs=(),
            )

    def close(self) -> None:
        """Close the journal."""
        try:
            self.journal.close()
        except OutputError as fault:
            self.notes = (*self.notes, fault.what)

    def finish(
        self, result: RunResult, ended: str, tasks: Sequence[TaskBelief]
    ) -> tuple[Path | None, tuple[str, ...]]:
        """Write the derived files after the last frame.

        Returns:
            The report, or None, and notes for the user.
        """
        if self.video:
            self.video.close()
        self._write()
        if self._waiting:
            unwritten = (
                f"{len(self._waiting) + self._lost} steps could not be recorded: {self._fault}"
            )
            self.notes = (*self.notes, unwritten)
            self.complete = False
        report = None
        try:
            verdict = result.verdict.value if result.verdict else None
            self.journal.note(
                verdict=verdict, steps=result.steps, problem=result.problem, tasks=tasks
            )
            export_events(self.folder / JOURNAL, self.folder / "events.jsonl")
            report = self._report(result)
            # Last, so that a run killed before can be resumed.
            self.journal.note(ended=ended)
        except OutputError as fault:
            # The verdict must reach the user even on a full disk.
            self.notes = (*self.notes, str(fault))
            self.complete = False
        return report, self.notes

    def _write(self) -> None:
        self._steps_to_retry = RETRY_STEPS if self._fault else 0
        try:
            if self._clock:
                self.journal.note(clock=self._clock.anchors)
                self._clock = None
            while self._waiting:
                self.journal.record(self._waiting[0])
                self._waiting.popleft()
            self._fault, self._steps_to_retry = "", 0
        except OutputError as fault:
            self._fault, self._steps_to_retry = fault.what, RETRY_STEPS

    def _derive(self, step: Step, frame: Frame, names: Iterable[str]) -> None:
        for name in names:
            try:
                if name in self._derived:
                    self._derived[name](step, frame)
            except Exception as fault:
                # Derived files may be lost; supervision and the journal go on.
                del self._derived[name]
                self.complete &= name != "report"
                note = f"the {name} stops at {step.time:.1f} s: {type(fault).__name__}: {fault}"
                self.notes = (*self.notes, note)

    def _report(self, result: RunResult) -> Path | None:
        from visup.report.page.html import write_report

        if not self._wants_report:
            return None
        path = self.folder / "report.html"
        try:
            write_report(self._run_data(result), path)
        except ExtraMissingError as missing:
            self.notes = (str(missing),)
            return None
        except OutputError:
            raise
        except Exception as fault:
            # The run itself is recorded; a failing report must not hide that.
            self.complete = False
            self.notes = (f"the report was not made: {type(fault).__name__}: {fault}",)
            return None
        return path

    def _run_data(self, result: RunResult) -> RunData:
        collected = self.collector.finish(
            result.verdict,
            self.facts,
            problem=result.problem,
            notes=self.notes,
            task_trees=self._task_trees,
        )
        videos = self.folder.glob("annotated*.webm")
        # In the order of writing: `annotated.webm`, `annotated-2.webm`, ...
        names = sorted((path.name for path in videos), key=lambda name: (len(name), name))
        return replace(collected, videos=tuple(names), clock=self._wall)


def _facts(settings: WatchSettings, source: VideoSource) -> dict[str, Any]:
    """The facts recorded at the beginning of a run."""
    redaction = {SOURCE_REDACTED: True} if has_secret(settings.source) else {}
    return {
        "visup": __version__,
        "source": source.name,
        "fps": source.fps,
        "size": source.size,
        "live": source.live,
        "settings": to_jsonable(replace(settings, source=redacted(settings.source))),
        **redaction,
    }


def recorder_state(recorder: Recorder | None) -> Mapping[str, Any] | None:
    """The state of a recorder for a checkpoint.

    Returns:
        None while steps are waiting: a state after a step that is not in the journal is useless.
    """
    if recorder is None:
        return {}
    return None if recorder.behind else recorder.collector.save()


def free_path(path: Path) -> Path:
    """An unused path next to the files of earlier parts of the run."""
    names = (path.with_name(f"{path.stem}-{n}{path.suffix}") for n in range(2, 10**6))
    # A dangling link counts as used: writing to it would create a file elsewhere.
    return next(p for p in chain((path,), names) if not os.path.lexists(p))

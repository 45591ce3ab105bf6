"""One supervised run with its folder: journal, events, annotated video and report."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import visup
from visup.agent import Frame, Severity, Verdict
from visup.agent.agent import Observer, Step
from visup.agent.encode import plain
from visup.agent.errors import ExtraMissingError, OutputError
from visup.agent.journal import Journal
from visup.agent.recording import export_events
from visup.percepts.video import Source
from visup.settings import WatchSettings
from visup.supervisor import build_agent, final_verdict, open_video

if TYPE_CHECKING:
    from visup.operator import Operator
    from visup.report.records import RunData

Progress = Callable[[int, int | None], None]
"""Told after each step how many frames are done and how many there are (None when not known)."""


@dataclass(frozen=True, slots=True)
class RunResult:
    """How a run ended.

    Attributes:
        verdict: Of the tasks; without a task 'interrupted' if something grave was told, else None.
        steps: Frames supervised.
        problem: What was wrong with the source, or None.
        folder: The run folder, or None.
        report: The report, or None.
        notes: What the user should know, such as an extra that is missing.
    """

    verdict: Verdict | None
    steps: int
    problem: str | None = None
    folder: Path | None = None
    report: Path | None = None
    notes: tuple[str, ...] = ()

    @property
    def exit_code(self) -> int:
        """0 when all went well, 1 when it failed, was unsafe, or could not be followed."""
        return 0 if self.verdict in (None, Verdict.SUCCEEDED, Verdict.IN_PROGRESS) else 1


def fresh_folder(out: Path | None, source: str) -> Path:
    """The folder of a run, made new; by default `runs/<source>`, numbered when that exists.

    Raises:
        OutputError: It cannot be made, or holds a run already (what was recorded is never lost).
    """
    if out is None:
        stem = Path(source).stem if Path(source).stem not in ("frames", "img1", "video") else ""
        stem = stem or Path(source).resolve().parent.name or "run"
        out = next(
            p
            for n in range(1, 10**6)
            if not (p := Path("runs") / (stem if n == 1 else f"{stem}-{n}")).exists()
        )
    if (out / "journal.sqlite").exists():
        raise OutputError(
            "the folder holds a run already",
            where=str(out),
            hint="choose another folder, or delete this one",
        )
    try:
        out.mkdir(parents=True, exist_ok=True)
        probe = out / ".writable"
        probe.touch()
        probe.unlink()
    except OSError as fault:
        raise OutputError(
            f"the output folder cannot be written: {fault.strerror}",
            where=str(out),
            hint="choose a folder that you may write to with --out",
        ) from fault
    return out


def supervise(
    settings: WatchSettings,
    folder: Path | None,
    *,
    observers: Sequence[Observer] = (),
    progress: Progress | None = None,
    video: bool = True,
    operator: Operator | None = None,
) -> RunResult:
    """Watch a source from start to end.

    Args:
        settings: What to watch and against what.
        folder: A folder from `fresh_folder`, or None to record nothing.
        observers: Told of each step besides the recorders.
        progress: Told of each step.
        video: Whether to write the annotated video.
        operator: Who answers questions; nobody by default.

    Returns:
        How it ended. A source that breaks off is told in `problem`; all that was seen is kept.

    Raises:
        VisupError: Something given is not as it should be.
    """
    tally = _Tally()
    with ExitStack() as stack:
        agent = build_agent(settings)
        source = stack.enter_context(open_video(settings))
        recorder = _Recorder(settings, source, folder, video, stack) if folder else None
        recording = (recorder,) if recorder else ()
        answering = (operator.attend(agent),) if operator else ()
        agent.observers = (tally, *recording, *observers, *answering)
        steps = 0
        try:
            for steps, _ in enumerate(agent.steps(source), start=1):
                if progress:
                    progress(steps, _steps_of(source, settings))
        except KeyboardInterrupt:
            tally.stopped = True
        verdict = final_verdict(agent.mind) if agent.mind.tasks else tally.verdict
        problem = "stopped by the user" if tally.stopped else source.problem
        result = RunResult(verdict, steps, problem, folder)
        return recorder.finish(result, agent.mind.tasks) if recorder else result


def _steps_of(source: Source, settings: WatchSettings) -> int | None:
    count = source.frame_count
    return None if count is None else -(-count // settings.every)


class _Tally:
    """Whether anything grave was told, for runs without a task."""

    def __init__(self) -> None:
        self.grave = False
        self.stopped = False

    def __call__(self, step: Step, frame: Frame) -> None:
        self.grave |= any(e.severity >= Severity.WARNING for e in step.events)

    @property
    def verdict(self) -> Verdict | None:
        return Verdict.INTERRUPTED if self.grave else None


class _Recorder:
    """Writes the run folder: the journal as the run goes, what is derived from it at the end."""

    def __init__(
        self,
        settings: WatchSettings,
        source: Source,
        folder: Path,
        video: bool,
        stack: ExitStack,
    ) -> None:
        from visup.report.data import Collector
        from visup.report.video import AnnotatedVideo

        self.folder = folder
        self.journal = Journal(folder / "journal.sqlite")
        stack.callback(self.journal.close)
        self.facts: dict[str, Any] = {
            "visup": visup.__version__,
            "source": source.name,
            "fps": source.fps,
            "size": source.size,
            "settings": plain(settings),
        }
        self.journal.note(**self.facts)
        self.notes = source.notes
        self.collector = Collector()
        path = folder / "annotated.webm"
        self.video = AnnotatedVideo(path, source.fps / settings.every) if video else None
        self._derived = {"report": self.collector.add}
        if self.video:
            self._derived["annotated video"] = self.video.add

    def __call__(self, step: Step, frame: Frame) -> None:
        self.journal.record(step, frame)
        for name, add in list(self._derived.items()):
            try:
                add(step, frame)
            except Exception as fault:
                # What is derived may be lost; supervision and the journal go on.
                del self._derived[name]
                said = f"the {name} stops at {step.time:.1f} s: {type(fault).__name__}: {fault}"
                self.notes = (*self.notes, said)

    def finish(self, result: RunResult, tasks: Sequence[Any]) -> RunResult:
        """Everything that is made once the last frame was seen."""
        if self.video:
            self.video.close()
        verdict = result.verdict.value if result.verdict else None
        self.journal.note(verdict=verdict, steps=result.steps, problem=result.problem, tasks=tasks)
        export_events(self.folder / "journal.sqlite", self.folder / "events.jsonl")
        report, notes = self._report(result)
        return RunResult(result.verdict, result.steps, result.problem, result.folder, report, notes)

    def _report(self, result: RunResult) -> tuple[Path | None, tuple[str, ...]]:
        from visup.report.html import write_report

        path = self.folder / "report.html"
        try:
            write_report(self._run_data(result), path)
        except ExtraMissingError as missing:
            return None, (str(missing),)
        except OutputError:
            raise
        except Exception as fault:
            # The run itself is recorded already; a report that cannot be made must not hide it.
            return None, (f"the report was not made: {type(fault).__name__}: {fault}",)
        return path, ()

    def _run_data(self, result: RunResult) -> RunData:
        return self.collector.finish(
            result.verdict, self.facts, problem=result.problem, notes=self.notes
        )

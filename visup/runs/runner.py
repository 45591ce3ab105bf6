"""One supervised run with its folder: journal, events, annotated video and report."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

from visup.agent import Frame, Severity, Verdict
from visup.agent.cycle.agent import Agent
from visup.agent.model.errors import OutputError
from visup.agent.model.step import Observer, Step
from visup.agent.storage.journal import Limits
from visup.percepts.video import VideoSource
from visup.percepts.video.live_source import LiveSource
from visup.percepts.video.realtime import in_real_time
from visup.runs.checkpoints import CheckpointWriter
from visup.runs.monotonic_clock import MonotonicFrames
from visup.runs.recorder import Recorder, recorder_state
from visup.runs.resume import InterruptedRun, catch_up
from visup.runs.runtime_faults import RuntimeFaults
from visup.runs.settings import WatchSettings
from visup.runs.wiring import build_agent, final_verdict, open_video
from visup.sinks import Sinks

if TYPE_CHECKING:
    from visup.runs.operator import HumanOperator

Progress = Callable[[int, int | None], None]
"""Told after each step how many frames are done and how many there are (None when not known)."""


@dataclass(frozen=True, slots=True)
class RunOptions:
    """How a run is recorded.

    Attributes:
        video: Whether to write the annotated video.
        report: Whether to write the report.
        limits: Of the journal.
        state_every_s: Seconds of the source between two states from which it could be resumed; 0 for
            none.
        sinks: Where alerts go besides, as of `--sink`.
    """

    video: bool = True
    report: bool = True
    limits: Limits = field(default_factory=Limits)
    state_every_s: float = 30.0
    sinks: tuple[str, ...] = ()


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
    operator: HumanOperator | None = None,
    notice: Callable[[str], None] | None = None,
    options: RunOptions | None = None,
    past: InterruptedRun | None = None,
) -> RunResult:
    """Watch a source from start to end.

    Args:
        settings: What to watch and against what.
        folder: A folder from `fresh_folder`, that of `past`, or None to record nothing.
        observers: Told of each step after it is recorded.
        progress: Told of each step.
        operator: Who answers questions; nobody by default.
        notice: Told what cannot wait for a step, such as that a camera dropped: one sentence.
        options: How it is recorded and told.
        past: The run to go on with; `settings` are its own.

    Returns:
        How it ended. A source that breaks off is told in `problem`; all that was seen is kept.

    Raises:
        VisupError: Something given is not as it should be.
    """
    options = options or RunOptions()
    tally = _SeverityMonitor(past.grave if past else False)
    troubles = RuntimeFaults()
    with ExitStack() as stack:
        source = stack.enter_context(open_video(settings))
        agent = build_agent(settings, also=(troubles,), live=source.live)
        stack.callback(agent.close)
        recorder = _recorder(settings, source, folder, options, past is not None, stack)
        sinks = Sinks(options.sinks, settings.source)
        stack.callback(sinks.close)
        states = CheckpointWriter(folder, options.state_every_s) if folder else None
        frames: Iterator[Frame] = source
        notes: tuple[str, ...] = ()
        if past:
            frames, notes = _caught_up(agent, source, past, recorder)
        # The journal comes first: what is told was recorded before.
        recording = (recorder,) if recorder else ()
        answering = (_attending(operator, agent, recorder, past),) if operator else ()
        agent.observers = (tally, *recording, *observers, sinks, *answering)
        if recorder:
            troubles.ask(recorder.runtime_faults)
        troubles.ask(sinks.runtime_faults)
        if isinstance(source, LiveSource):
            source.notify = notify(sinks, notice)
            troubles.ask(source.runtime_faults)
        pace = in_real_time(source, frames) if _keeps_pace(settings, source) else None
        if pace:
            stack.callback(pace.close)
            troubles.ask(pace.runtime_faults)
        begin = agent.mind.time if past and past.steps else None
        steady = MonotonicFrames(pace or frames, source.fps, begin)
        troubles.ask(steady.runtime_faults)
        steps = past.steps if past else 0
        try:
            for step in agent.steps(steady):
                steps += 1
                if states:
                    states.offer(agent, step, lambda: recorder_state(recorder))
                if progress:
                    progress(steps, _steps_of(source, settings))
        except KeyboardInterrupt:
            tally.stopped = True
        if states:
            states.close()
            notes += (states.note,) if states.note else ()
        verdict = final_verdict(agent.mind) if agent.mind.tasks else tally.verdict
        problem = "stopped by the user" if tally.stopped else source.problem
        if pace and (dropped := pace.note()):
            notes += (dropped,)
        notes += sinks.end(verdict, steps)
        if recorder is None:
            return RunResult(verdict, steps, problem, notes=notes)
        ended = source.ended.value if source.ended and not tally.stopped else "stopped"
        report, more = recorder.finish(verdict, steps, problem, ended, agent.mind.tasks)
        return RunResult(verdict, steps, problem, folder, report, (*notes, *more))


def _attending(
    operator: HumanOperator, agent: Agent, recorder: Recorder | None, past: InterruptedRun | None
) -> Observer:
    """The operator of a run, who does not say again what was taken up before the run was killed."""
    if recorder and not past:
        recorder.journal.note(answers=operator.answers)
    given = {**past.answers, **operator.answers} if past else operator.answers
    waiting = {i: name for i, name in given.items() if i not in agent.mind.answers}
    attend = replace(operator, answers=waiting)
    return attend.attend(agent, at_once=past is not None)


def notify(sinks: Sinks, notice: Callable[[str], None] | None) -> Callable[[str], None]:
    """What tells a sentence to sinks and to `notice` at once."""

    def tell(text: str) -> None:
        sinks.notice(text)
        if notice:
            notice(text)

    return tell


def _recorder(
    settings: WatchSettings,
    source: VideoSource,
    folder: Path | None,
    options: RunOptions,
    resume: bool,
    stack: ExitStack,
) -> Recorder | None:
    if folder is None:
        return None
    made = Recorder(
        settings,
        source,
        folder,
        video=options.video,
        report=options.report,
        limits=options.limits,
        resume=resume,
    )
    stack.callback(made.close)
    return made


def _caught_up(
    agent: Agent, source: VideoSource, past: InterruptedRun, recorder: Recorder | None
) -> tuple[Iterator[Frame], tuple[str, ...]]:
    if recorder and past.state:
        recorder.collector.load(past.state.kept)
    tell = recorder.catch_up if recorder else lambda step, frame: None
    return catch_up(agent, source, past, tell)


def _keeps_pace(settings: WatchSettings, source: VideoSource) -> bool:
    return source.live if settings.realtime is None else settings.realtime


def _steps_of(source: VideoSource, settings: WatchSettings) -> int | None:
    count = source.frame_count
    return None if count is None else -(-count // settings.every)


class _SeverityMonitor:
    """Whether anything grave was told, for runs without a task."""

    def __init__(self, grave: bool = False) -> None:
        self.grave = grave
        self.stopped = False

    def __call__(self, step: Step, frame: Frame) -> None:
        self.grave |= any(e.severity >= Severity.WARNING for e in step.events)

    @property
    def verdict(self) -> Verdict | None:
        return Verdict.INTERRUPTED if self.grave else None

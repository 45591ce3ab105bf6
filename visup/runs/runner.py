"""One supervised run with its folder: journal, events, annotated video and report."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import ExitStack, suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, cast

from visup.agent import Frame
from visup.agent.execution.runners import error_line
from visup.agent.model.errors import OutputError
from visup.agent.model.step import Observer, Step
from visup.agent.storage.wall_clock import RecordStamp, WallClock
from visup.compiled import cache_note
from visup.percepts.video.live_source import LiveSource
from visup.percepts.video.realtime import RealTimeFrames, in_real_time
from visup.runs.checkpoints import CheckpointWriter
from visup.runs.evidence.keeper import EvidenceKeeper
from visup.runs.inputs.answer_box import AnswerBox
from visup.runs.inputs.audience import Audience, RunFigures, RunProgress
from visup.runs.inputs.preflight import check_cast, taught_actor_notes
from visup.runs.inputs.run_folder import discard_unbegun, fresh_folder
from visup.runs.inputs.run_sinks import sinks_of
from visup.runs.inputs.stop_signals import stop_signals
from visup.runs.monotonic_clock import MonotonicFrames
from visup.runs.recorder import Recorder, recorder_state
from visup.runs.result import RunResult
from visup.runs.resume import InterruptedRun, catch_up
from visup.runs.runtime_faults import RuntimeFaults
from visup.runs.settings import RunOptions, WatchSettings
from visup.runs.unattended.next_run import RollOver, RunFolders
from visup.runs.unattended.phase_meter import PhaseMeter
from visup.runs.wiring import VerdictMonitor, build_agent, closing_notes, final_verdict, open_video
from visup.sinks import Sinks
from visup.version import __version__

if TYPE_CHECKING:
    from visup.runs.operator import HumanOperator

CLOSE_JOURNALS_S = 2.0
"""Time to finish the files of earlier runs when the last one ends, seconds."""

__all__ = ["Audience", "RunProgress", "fresh_folder", "notify", "supervise", "supervised"]


def supervise(
    settings: WatchSettings,
    folder: Path | None,
    *,
    audience: Audience | None = None,
    options: RunOptions | None = None,
    past: InterruptedRun | None = None,
    at_once: bool = True,
) -> RunResult:
    """Watch a source from start to end.

    Args:
        settings: Settings of the run.
        folder: A folder from `fresh_folder`, that of `past`, or None to record nothing.
        audience: Observers of the run.
        options: How it is recorded, and where alerts go.
        past: The run to resume; `settings` are its own.
        at_once: Whether a stop signal interrupts the present step; otherwise the step is finished first.

    Returns:
        The result. A source that breaks off is reported in `problem`; everything seen is kept.

    Raises:
        VisupError: An input is not valid.
    """
    run = supervised(settings, folder, audience or Audience(), options, past)
    with stop_signals(at_once=at_once) as stop:
        try:
            with suppress(KeyboardInterrupt):  # may arrive between two steps
                while not stop.received:
                    next(run)
            stop.closing = True
            run.throw(KeyboardInterrupt())
        except StopIteration as end:
            result: RunResult = end.value
    return result


def supervised(
    settings: WatchSettings,
    folder: Path | None,
    audience: Audience,
    options: RunOptions | None = None,
    past: InterruptedRun | None = None,
) -> Generator[Step, None, RunResult]:
    """As `supervise`, but as a generator of steps; the source is open when it returns.

    A KeyboardInterrupt thrown in ends the run as stopped by the user, with verdict and report; a generator
    that is only closed leaves the run like a killed one, to be resumed.
    """
    run = _supervised(settings, folder, audience, options or RunOptions(), past)
    next(run)
    return cast("Generator[Step, None, RunResult]", run)


def _supervised(
    settings: WatchSettings,
    folder: Path | None,
    audience: Audience,
    options: RunOptions,
    past: InterruptedRun | None,
) -> Generator[Step | None, None, RunResult]:
    """Yields None once everything is open, then the steps."""
    with ExitStack() as stack:
        answered = audience.operator is not None and bool(audience.operator.answers)
        run = _SupervisedRun(settings, folder, options, past, stack, answered=answered)
        run.keep_evidence()
        frames = run.catch_up(past) if past else run.source
        run.connect(audience, past)
        timed = run.timed(frames, past)
        yield None
        yield from run.watch(timed, audience)
        return run.result()


class _SupervisedRun:
    """A run from its first frame to its result; its resources are closed with `stack`."""

    def __init__(
        self,
        settings: WatchSettings,
        folder: Path | None,
        options: RunOptions,
        past: InterruptedRun | None,
        stack: ExitStack,
        *,
        answered: bool,
    ) -> None:
        self._faults = RuntimeFaults()
        self._meter, self._roll_over = PhaseMeter(), RollOver(options)
        self.source = stack.enter_context(open_video(settings, options.span))
        self._agent = build_agent(settings, extra=(self._faults,), live=self.source.live)
        stack.callback(self._agent.close)
        self._warnings = () if past else check_cast(settings, self._agent, answered=answered)
        # The bound actors are recorded, so that a replay, which has no models, knows them.
        actors = self._agent.mind.actors
        self._notes = taught_actor_notes(settings.actors, actors)
        settings = replace(settings, actors=dict(actors))
        self._settings, self._folder, self._stack = settings, folder, stack
        # Before the journal, so that a refused run leaves nothing behind.
        clock = past.recording.facts().get("clock") if past else None
        self._stamp = RecordStamp(options.camera, WallClock.read(clock), live=self.source.live)
        written = past.recording.written() if past else None
        self._sinks = sinks_of(options, settings.source, self._stamp, written)
        stack.callback(self._sinks.close)
        self._recorder = self._recorder_in(folder, options, resume=past is not None)
        stack.callback(self._close_journals)
        if past:
            past.check_unchanged()  # under the lock
        self._checkpoints = CheckpointWriter(folder, options.state_every_s) if folder else None
        self._alarms = VerdictMonitor(past.verdict if past else None)
        self._pace: RealTimeFrames | None = None
        self._steps = past.steps if past else 0
        self._options, self._stopped = options, False
        self._last: Step | None = None  # None during a step

    def _recorder_in(
        self, folder: Path | None, options: RunOptions, *, resume: bool
    ) -> Recorder | None:
        if folder is None:
            return None
        return Recorder(self._settings, self.source, folder, options, resume=resume)

    def _close_journals(self) -> None:
        self._roll_over.wait(CLOSE_JOURNALS_S)
        if self._recorder:
            self._recorder.close()

    def catch_up(self, past: InterruptedRun) -> Iterator[Frame]:
        """Restore the agent, and return the remaining frames."""
        past, restored = self._load_state(past)
        on_step = self._recorder.catch_up if self._recorder else lambda step, frame: None
        send_missed = self._sinks.alerts.send_missed
        frames, notes = catch_up(
            self._agent, self.source, past, on_step, send_missed, restored=restored
        )
        self._notes = (*self._notes, *notes)
        return frames

    def _load_state(self, past: InterruptedRun) -> tuple[InterruptedRun, bool]:
        """Load the saved state; returns the run, without a state that cannot be loaded.

        The content of a state depends on the versions of visup and of behaviours: one that does not fit is
        skipped, since the journal has the same information.
        """
        if past.state is None:
            return past, False
        try:
            if self._recorder:
                self._recorder.collector.load(past.state.recorder)
            return past, self._agent.load(past.state.agent)
        except Exception as fault:
            self._agent.close()
            self._agent = build_agent(self._settings, extra=(self._faults,), live=self.source.live)
            self._stack.callback(self._agent.close)
            if self._recorder:
                self._recorder.restart_report()
            why = f"its checkpoint is of another form than visup {__version__} has: {error_line(fault)}"
            return replace(past, state=None, why_none=why), False

    def connect(self, audience: Audience, past: InterruptedRun | None) -> None:
        """Connect the observers, and the sources of runtime faults."""
        if self._recorder:
            self._stamp.changed = self._recorder.record_clock
            if self._stamp.clock.anchors:
                self._recorder.record_clock(self._stamp.clock)
        # The journal comes first, so that everything reported is recorded.
        recording = (self._recorder,) if self._recorder else ()
        answering = (self._attending(audience.operator, past),) if audience.operator else ()
        # Evidence comes before the sinks, which link to it.
        evidence = (self._evidence,) if self._evidence else ()
        box = (AnswerBox(self._agent, lambda: self._folder, audience.notice),) if recording else ()
        after_recording = (*audience.observers, *evidence, self._sinks, *answering, *box)
        clocked = (self._stamp,) if self.source.live else ()
        self._agent.observers = (self._alarms, *clocked, *recording, *after_recording)
        for warning in self._warnings:
            self._issue_warning(warning, audience.notice)
        if self._recorder:
            self._faults.add_source(
                lambda: self._recorder.runtime_faults() if self._recorder else ()
            )
        self._faults.add_source(self._sinks.runtime_faults)
        if isinstance(self.source, LiveSource):
            self.source.notify = notify(self._sinks, audience.notice)
            self._faults.add_source(self.source.runtime_faults)

    def keep_evidence(self) -> None:
        """Save evidence of alerts, if requested."""
        self._evidence: EvidenceKeeper | None = None
        options = self._options.evidence
        if options is None or self._folder is None:
            return
        fps = self.source.fps / self.source.every
        keeper = self._evidence = EvidenceKeeper(self._folder, options, fps, self._stamp)
        self._stack.callback(keeper.close, self._options.closing_s)
        self._faults.add_source(keeper.runtime_faults)
        self._sinks.alerts.links = keeper.links

    def _issue_warning(self, text: str, notice: Callable[[str], None] | None) -> None:
        """Issue a warning before the first frame; without an audience it is added to the notes."""
        if notice:
            notice(text)
        else:
            self._notes = (*self._notes, text)

    def timed(self, frames: Iterator[Frame], past: InterruptedRun | None) -> MonotonicFrames:
        """Frames with increasing times, in real time if requested."""
        realtime = self._settings.realtime
        if self.source.live if realtime is None else realtime:
            self._pace = in_real_time(self.source, frames)
            self._stamp.lag = self._pace.lag
            self._stack.callback(self._pace.close)
            self._faults.add_source(self._pace.runtime_faults)
        begin = self._agent.mind.time if past and (past.steps or past.state) else None
        monotonic = MonotonicFrames(self._pace or frames, self.source.fps, begin)
        self._faults.add_source(monotonic.runtime_faults)
        return monotonic

    def watch(self, frames: Iterable[Frame], audience: Audience) -> Iterator[Step]:
        """Step through frames until they end or the user stops."""
        try:
            for frame in frames:
                self._last = None
                step = self._meter.step(self._agent, frame)
                self._steps, self._last = self._steps + 1, step
                if self._checkpoints:
                    self._checkpoints.offer(
                        self._agent, step, lambda: recorder_state(self._recorder)
                    )
                self._report_figures(step, audience)
                if audience.folders and self._recorder and self.source.live:
                    self._roll(step, self._recorder, audience)
                yield step
        except KeyboardInterrupt:
            self._stopped = True

    def _roll(self, step: Step, old: Recorder, audience: Audience) -> None:
        """Start the next run if it is due: the same agent with a new journal."""
        if not (audience.folders and self._roll_over.due(step.time, old.journal.size)):
            return
        try:
            new, checkpoints = self._next_recorder(step, old, audience.folders)
        except OutputError as fault:
            self._roll_over.failed(step.time)
            if audience.notice:
                audience.notice(f"the next run cannot be started: {fault}")
            return
        mind, before = self._agent.mind, self._checkpoints
        verdict = final_verdict(mind) if mind.tasks else self._alarms.verdict
        result = RunResult(verdict, self._steps, has_task=bool(mind.tasks), seconds=step.time)
        self._agent.observers = [new if o is old else o for o in self._agent.observers]
        self._recorder, self._checkpoints, self._folder = new, checkpoints, new.folder
        self._stamp.changed = new.record_clock
        if self._evidence:
            self._evidence.move_to(new.folder)
        self._steps, self._alarms.verdict = 0, None
        self._roll_over.begun(step.time)
        assert before
        self._roll_over.finish_files(old, before, result, mind.tasks)

    def _next_recorder(
        self, step: Step, old: Recorder, folders: RunFolders
    ) -> tuple[Recorder, CheckpointWriter]:
        """The journal and the checkpoint of the next run, from which it can already be resumed.

        Raises:
            OutputError: They cannot be written.
        """
        folder = fresh_folder(folders.next_folder(), self._settings.source)
        new: Recorder | None = None
        try:
            new = Recorder(self._settings, self.source, folder, self._options)
            new.journal.note(continues=old.folder.name, clock=self._stamp.clock.anchors)
            checkpoints = CheckpointWriter(folder, self._options.state_every_s)
            checkpoints.keep(self._agent, step, recorder_state(new))
            folders.set_current(folder)
        except OutputError:
            if new:
                new.close()
            discard_unbegun(folder)
            raise
        with suppress(OutputError):
            old.journal.note(next_run=folder.name)
        return new, checkpoints

    def _report_figures(self, step: Step, audience: Audience) -> None:
        lag = self._pace.lag(step.time) if self._pace else None
        if audience.progress:
            count = self.source.frame_count
            total = None if count is None else -(-count // self.source.every)
            audience.progress(self._steps, total, lag)
        if audience.figures:
            dropped = self._pace.dropped if self._pace else 0
            audience.figures(RunFigures(self._steps, dropped, lag, self._meter.ms))

    def result(self) -> RunResult:
        """Close the run and return its result."""
        if self._checkpoints:
            if self._last and (self._stopped or self._options.span[1] is not None):
                self._checkpoints.keep(self._agent, self._last, recorder_state(self._recorder))
            self._checkpoints.close()
        mind = self._agent.mind
        verdict = final_verdict(mind) if mind.tasks else self._alarms.verdict
        problem = "stopped by the user" if self._stopped else self.source.problem
        late_notes = (
            cache_note(),
            self._checkpoints.note if self._checkpoints else None,
            self._pace.note() if self._pace else None,
            *closing_notes(mind, self._settings.at_end),
            *self._sinks.end(verdict, self._steps),
        )
        notes = (*self._notes, *filter(None, late_notes))
        result = RunResult(
            verdict,
            self._steps,
            problem,
            notes=notes,
            has_task=bool(mind.tasks),
            stopped=self._stopped,
            seconds=mind.time,
            delivered=self._sinks.delivered,
        )
        if self._recorder is None:
            return result
        ended = self.source.ended.value if self.source.ended and not self._stopped else "stopped"
        report, report_notes = self._recorder.finish(result, ended, mind.tasks)
        return replace(
            result,
            folder=self._folder,
            report=report,
            notes=(*notes, *report_notes),
            recorded=self._recorder.complete,
        )

    def _attending(self, operator: HumanOperator, past: InterruptedRun | None) -> Observer:
        """The operator, without answers already applied before the run was killed."""
        if self._recorder and not past:
            self._recorder.journal.note(answers=operator.answers)
        answers = {**past.answers, **operator.answers} if past else operator.answers
        applied = self._agent.mind.answers
        pending = {i: name for i, name in answers.items() if i not in applied}
        return replace(operator, answers=pending).attend(self._agent, at_once=past is not None)


def notify(sinks: Sinks, notice: Callable[[str], None] | None) -> Callable[[str], None]:
    """A function that passes a sentence to sinks and to `notice` at once."""

    def pass_on(text: str) -> None:
        sinks.notice(text)
        if notice:
            notice(text)

    return pass_on

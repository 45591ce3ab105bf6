"""Resumes a killed run: restores the agent to its state after the last recorded step.

The mind is reproduced exactly by replaying the observations in the journal. Behaviours restore the latest
saved state and process the frames since then again, or all frames without a saved state. For a camera, whose
frames are gone, behaviours continue from the saved state.
"""

from __future__ import annotations

import shlex
import time
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any

from visup.agent import Frame, Observation, Severity, Verdict
from visup.agent.cycle.agent import Agent
from visup.agent.cycle.system_alerts import verdict_without_task
from visup.agent.model.errors import OutputError, SettingsError, SourceError
from visup.agent.model.step import Step
from visup.agent.plugins.factory import MODULE_PATH
from visup.agent.storage.codec import pack_observation
from visup.agent.storage.journal_reader import Recording
from visup.percepts.video import VideoSource
from visup.redaction import redacted
from visup.runs.checkpoints import Checkpoint, read_checkpoint
from visup.runs.runtime_faults import RuntimeFaults
from visup.runs.settings import SOURCE_REDACTED, WatchSettings

if TYPE_CHECKING:
    from pydantic import TypeAdapter


@dataclass(frozen=True, slots=True)
class InterruptedRun:
    """Facts about the run to resume.

    Attributes:
        recording: Its journal.
        settings: Its original settings.
        state: The latest state, or None.
        why_none: Why an existing state cannot be used, or None.
        steps: Number of recorded steps.
        verdict: Verdict from its events, if it has no task.
        answers: Answers of the operator in advance: object id -> name.
    """

    recording: Recording
    settings: WatchSettings
    state: Checkpoint | None
    why_none: str | None
    steps: int
    verdict: Verdict | None
    answers: Mapping[int, str]

    def check_unchanged(self) -> None:
        """Check that no other process has resumed the run since it was read.

        Raises:
            OutputError: One has.
        """
        if self.recording.count() != self.steps:
            raise OutputError(
                "another process has resumed this run in the meantime",
                where=str(self.recording.path.parent),
                hint="resume it again, if it is not over",
            )


def interrupted_run(
    run: Path,
    behaviours: Collection[Path | str] = (),
    plugins: Collection[str] = (),
    source: str | None = None,
) -> InterruptedRun:
    """Read a run to resume.

    The content of a run folder is data. User behaviours named in it are code of unknown origin: they run only
    if they are named again here.

    Args:
        run: A run folder.
        behaviours: Files or modules of the run's user behaviours that may run.
        plugins: Names of the run's installed behaviours that may run.
        source: The source with its password, which is not recorded; None if it has none.

    Raises:
        OutputError: There is no run, it has ended, or nothing was recorded.
        SettingsError: Its behaviours differ from those named, or its source is not named as required.
    """
    recording = Recording.open(run)
    facts = recording.facts()
    if "settings" not in facts:
        raise OutputError("nothing was recorded of this run", where=str(run), hint="begin it anew")
    if facts.get("ended") == "rolled":
        raise OutputError(
            "this run is complete: it continues in another one",
            where=str(run),
            hint=f"that is {run.parent / str(facts.get('next_run'))}",
        )
    if facts.get("ended") == "complete":
        raise OutputError(
            "this run is complete: its source was watched to the end",
            where=str(run),
            hint=f"visup replay {run}",
        )
    state, why_none = read_checkpoint(recording.path.parent)
    recorded_range = recording.first_and_last()
    continues = facts.get("continues") is not None
    if state is not None and not _belongs(state, recorded_range, continues=continues):
        state, why_none = None, "its checkpoint does not belong to this journal"
    if state is None and (facts.get("steps_dropped") or continues):
        raise OutputError(
            "neither the first steps of this run nor a later checkpoint is kept",
            where=str(run),
            hint="begin a new run",
        )
    verdict = verdict_without_task(map(_kind, filter(_is_grave, recording.events())))
    settings = _with_named_code(recorded_settings(facts, str(run)), run, behaviours, plugins)
    settings = _with_secret(settings, run, source, needed=bool(facts.get(SOURCE_REDACTED)))
    answers = _answers(facts, str(run))
    return InterruptedRun(recording, settings, state, why_none, recording.count(), verdict, answers)


def _belongs(state: Checkpoint, recorded_range: tuple[int, int] | None, *, continues: bool) -> bool:
    """Whether a state belongs to a recorded step, or to the run that this one continues."""
    if recorded_range is None:
        return continues
    return recorded_range[0] - 1 <= state.frame_index <= recorded_range[1] or (
        continues and state.frame_index < recorded_range[0]
    )


def _with_named_code(
    recorded: WatchSettings, run: Path, behaviours: Collection[Path | str], plugins: Collection[str]
) -> WatchSettings:
    """The settings of a run with the code named by the user, which must match."""
    recorded_names = sorted(map(_code_name, recorded.behaviours)), sorted(recorded.plugins)
    if recorded_names != (sorted(map(_code_name, behaviours)), sorted(plugins)):
        behaviour = [w for where in recorded.behaviours for w in ("--behaviour", str(where))]
        options = [*behaviour, *(w for name in recorded.plugins for w in ("--plugin", name))]
        # Quoted: text from a folder must not become commands when the hint is pasted.
        again = shlex.join(["visup", "watch", "--resume", str(run), *options])
        raise SettingsError(
            "this run used custom behaviours, which are code; code is never run from a run folder"
            if options
            else "this run used no custom behaviours",
            where=str(run),
            expected=shlex.join(options) or "neither --behaviour nor --plugin",
            hint=f"if you trust them, name them again: {again}" if options else None,
        )
    return replace(recorded, behaviours=tuple(behaviours), plugins=tuple(plugins))


def _with_secret(
    recorded: WatchSettings, run: Path, source: str | None, *, needed: bool
) -> WatchSettings:
    """The settings of a run with the password of its source."""
    if needed and source is None:
        raise SettingsError(
            "the source of this run had a password, which is not recorded",
            where=str(run),
            expected=f"the address of {recorded.source} with user and password",
            hint=f"visup watch ADDRESS --resume {shlex.quote(str(run))}",
        )
    if source is None:
        return recorded
    if redacted(source) != recorded.source:
        raise SettingsError(
            "this is not the source of the run",
            where=redacted(source),
            expected=recorded.source if needed else "no source: it is known",
        )
    return replace(recorded, source=source)


def _code_name(where: Path | str) -> str:
    """The name by which code is matched: a module path, or a file name regardless of its folder."""
    return str(where) if MODULE_PATH.fullmatch(str(where)) else Path(where).name


def _is_grave(event: Mapping[str, Any]) -> bool:
    return event.get("severity") != Severity.INFO.name.lower()


def _kind(event: Mapping[str, Any]) -> str:
    """The kind of a recorded event; the journal is untrusted."""
    data = event.get("data")
    alert_kind = data.get("alert_kind") if isinstance(data, dict) else None
    return str(alert_kind or event.get("kind"))


def _answers(facts: Mapping[str, Any], where: str) -> Mapping[int, str]:
    try:
        return {int(i): str(name) for i, name in facts.get("answers", {}).items()}
    except (AttributeError, ValueError) as fault:
        raise OutputError("the run's answers cannot be read", where=where) from fault


@cache
def _settings_form() -> TypeAdapter[WatchSettings]:
    """Cached: creating it takes longer than parsing the settings of a run."""
    from pydantic import TypeAdapter

    return TypeAdapter(WatchSettings)


def recorded_settings(facts: Mapping[str, Any], where: str) -> WatchSettings:
    """The settings of a recorded run.

    Raises:
        OutputError: They are missing or not valid.
    """
    from pydantic import ValidationError

    try:
        return _settings_form().validate_python(facts.get("settings"))
    except ValidationError as fault:
        message = fault.errors()[0]["msg"]
        raise OutputError(f"the run's settings cannot be read ({message})", where=where) from fault


def catch_up(
    agent: Agent,
    source: VideoSource,
    past: InterruptedRun,
    on_step: Callable[[Step, Frame], None],
    on_recorded_step: Callable[[Step], None],
    *,
    restored: bool,
) -> tuple[Iterator[Frame], tuple[str, ...]]:
    """Bring an agent to its state after the last recorded step.

    Args:
        agent: Agent with the run's settings; new, or restored from a state.
        source: The source, just opened.
        past: The run.
        on_step: Receives recorded steps whose frames exist.
        on_recorded_step: Receives all recorded steps since the state.
        restored: Whether the behaviours were restored, too.

    Returns:
        The frames that follow, and notes for the user.

    Raises:
        SourceError: The source differs from the recorded one.
    """
    after = past.state.frame_index if past.state else -1
    if source.live:
        return _live(agent, source, past, on_recorded_step, after), (
            "Nothing was seen in between.",
        )
    answers = past.recording.answers()
    differing = 0
    frames: Iterator[Frame] = iter(source)
    for observation in past.recording.observations(after):
        frame = _frame(frames, observation, source)
        perceived = agent.perceive(frame)
        differing += pack_observation(_without_runtime_faults(perceived)) != pack_observation(
            _without_runtime_faults(observation)
        )
        step = agent.reason(observation, answers.get(observation.frame_index, {}))
        on_step(step, frame)
        on_recorded_step(step)
    notes = []
    if not restored and past.steps:
        why = f" ({past.why_none})" if past.why_none else ""
        notes.append(f"All {past.steps} earlier frames were perceived again{why}.")
    if differing:
        notes.append(
            f"{differing} frames look different now than when they were recorded: "
            "behaviours may have changed."
        )
    last = past.recording.first_and_last()
    begin = max(after, last[1] if last else -1)
    return (f for f in frames if f.index > begin), tuple(notes)


def _frame(frames: Iterator[Frame], observation: Observation, source: VideoSource) -> Frame:
    for frame in frames:
        if frame.index == observation.frame_index and frame.size == observation.frame_size:
            return Frame(frame.index, observation.time, frame.image)
        if frame.index >= observation.frame_index:
            break
    width, height = observation.frame_size
    raise SourceError(
        "the source is not what was recorded",
        where=source.name,
        expected=f"a frame {observation.frame_index} of {width}x{height} pixels",
        hint="a run can only go on with its own video",
    )


def _without_runtime_faults(observation: Observation) -> Observation:
    name = RuntimeFaults.contract.name
    return replace(
        observation, reports=tuple(r for r in observation.reports if r.behaviour != name)
    )


def _live(
    agent: Agent,
    source: VideoSource,
    past: InterruptedRun,
    on_recorded_step: Callable[[Step], None],
    after: int,
) -> Iterator[Frame]:
    """Frames of a camera, with numbers and times continued from the last recorded one."""
    answers = past.recording.answers()
    for last in past.recording.observations(after):
        on_recorded_step(agent.reason(last, answers.get(last.frame_index, {})))
        for behaviour in agent.behaviours:
            if missed := getattr(behaviour, "missed", None):
                missed(last)
    first = next(source, None)
    if first is None:
        return iter(())
    # Only the gap is measured by the wall clock, since it may have been set meanwhile.
    gap_s = max(1.0 / source.fps, time.time() - past.recording.written())
    time_offset = agent.mind.time + gap_s - first.time
    index_offset = agent.mind.frame_index + 1
    return (
        Frame(f.index + index_offset, f.time + time_offset, f.image)
        for f in chain((first,), source)
    )

"""Replays the reasoning of a recorded run without perception, and compares the results.

This tests rules and tasks on recorded missions: record once, replay in seconds with new rules or tasks, and
compare events, alerts, stages and verdict.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from difflib import SequenceMatcher
from pathlib import Path
from typing import Any

from visup.agent import Verdict
from visup.agent.cycle.system_alerts import grave_kinds, verdict_without_task
from visup.agent.model.step import Step
from visup.agent.storage.journal import Journal
from visup.agent.storage.journal_reader import JOURNAL, Recording, event_text, export_events
from visup.agent.storage.jsonable import event_record, to_jsonable
from visup.runs.resume import recorded_settings
from visup.runs.settings import WatchSettings
from visup.runs.wiring import closing_notes, final_verdict, reasoning_agent
from visup.tasks import load_tasks
from visup.tasks.grammar.structure import spare_kinds, task_actors
from visup.version import __version__

Line = Mapping[str, Any]
STAGE = "stage_"


@dataclass(frozen=True, slots=True)
class Transcript:
    """The events of a run.

    Attributes:
        events: Events as in `events.jsonl`.
        verdict: The verdict; None without a task, or if the run has not ended.
        steps: Number of frames.
        seconds: Wall time of the reasoning; 0 for a recorded run.
        at_end: Results of rules that were undecided at the end, as the settings request.
    """

    events: tuple[Line, ...]
    verdict: str | None
    steps: int
    seconds: float = 0.0
    at_end: tuple[str, ...] = ()

    def of(self, kinds: Callable[[str], bool]) -> tuple[Line, ...]:
        """The events of some kinds."""
        return tuple(e for e in self.events if kinds(str(e.get("kind"))))


@dataclass(frozen=True, slots=True)
class TranscriptDiff:
    """The difference between two runs, ordered by time.

    Attributes:
        gone: Events of the first only.
        new: Events of the second only.
        verdicts: Verdicts of both.
    """

    gone: tuple[Line, ...] = ()
    new: tuple[Line, ...] = ()
    verdicts: tuple[str | None, str | None] = (None, None)

    def __bool__(self) -> bool:
        return bool(self.gone or self.new or self.verdicts[0] != self.verdicts[1])

    def counts(self) -> dict[str, tuple[int, int]]:
        """Counts of gone and new events by group: alerts, stages, other events."""
        return {
            group: (_count(self.gone, group), _count(self.new, group))
            for group in ("alerts", "stages", "other events")
        }


@dataclass(slots=True)
class _EventCollector:
    """Collects the events of a run."""

    events: list[Line] = field(default_factory=list)
    steps: int = 0
    alarms: Verdict | None = None

    def __call__(self, step: Step) -> None:
        self.steps += 1
        for event in step.events:
            self.events.append(event_record(event))
        self.alarms = verdict_without_task(grave_kinds(step.events), self.alarms)


def settings_for(recording: Recording, **changed: Any) -> WatchSettings:
    """The settings of a recorded run with some of them changed; see `changed_settings`."""
    settings = recorded_settings(recording.facts(), str(recording.path))
    return changed_settings(settings, **changed)


def changed_settings(settings: WatchSettings, **changed: Any) -> WatchSettings:
    """Settings with some of them changed; None and () change nothing.

    If tasks are changed but actors are not, bindings of actors that the new tasks lack are dropped.
    """
    changes = {k: v for k, v in changed.items() if v}
    if "tasks" in changes and "actors" not in changes:
        tasks = [t for name in changes["tasks"] for t in load_tasks(name)]
        known = {a for task in tasks for a in (*task_actors(task), *spare_kinds(task))}
        changes["actors"] = {a: m for a, m in settings.actors.items() if a in known}
    return replace(settings, **changes)


def replay(
    recording: Recording,
    settings: WatchSettings,
    out: Path | None = None,
    on_step: Callable[[Step], None] | None = None,
) -> Transcript:
    """Replay the reasoning of a run.

    Args:
        recording: The recorded run.
        settings: Tasks, rules and actors to reason with.
        out: A new run folder for a journal and `events.jsonl`, or None.
        on_step: Receives each step.

    Returns:
        The transcript.

    Raises:
        VisupError: The recording is damaged, or a task or rules file is not valid.
    """
    agent = reasoning_agent(settings)
    listener = _EventCollector()
    with ExitStack() as stack:
        journal = _journal(recording, settings, out, stack) if out else None
        answers = recording.answers()
        begin = time.perf_counter()
        for observation in recording.observations():
            step = agent.reason(observation, answers.get(observation.frame_index, {}))
            if journal:
                journal.record(step)
            listener(step)
            if on_step:
                on_step(step)
        seconds = time.perf_counter() - begin
        result = final_verdict(agent.mind) if agent.mind.tasks else listener.alarms
        verdict = result.value if result else None
        if journal:
            journal.note(verdict=verdict, steps=listener.steps, tasks=agent.mind.tasks)
            export_events(journal.path, journal.path.with_name("events.jsonl"))
            journal.note(ended="complete")
    at_end = closing_notes(agent.mind, settings.at_end)
    return Transcript(tuple(listener.events), verdict, listener.steps, seconds, at_end)


def recorded_transcript(recording: Recording) -> Transcript:
    """The events of a recorded run."""
    verdict = recording.facts().get("verdict")
    verdict_text = verdict if isinstance(verdict, str) else None
    return Transcript(tuple(recording.events()), verdict_text, recording.count())


def transcript_diff(first: Transcript, second: Transcript) -> TranscriptDiff:
    """Events in only one of two runs.

    Events are equal if all their fields are. Faults of behaviours and of the environment count like any
    other: they are part of the observations.
    """
    a = [event_text(e) for e in first.events]
    b = [event_text(e) for e in second.events]
    gone: list[Line] = []
    new: list[Line] = []
    for operation, i0, i1, j0, j1 in SequenceMatcher(None, a, b, autojunk=False).get_opcodes():
        if operation != "equal":
            gone += first.events[i0:i1]
            new += second.events[j0:j1]
    return TranscriptDiff(tuple(gone), tuple(new), (first.verdict, second.verdict))


def group_of(event: Line) -> str:
    """The group of an event: 'alerts', 'stages' or 'other events'."""
    kind = str(event.get("kind"))
    if kind in ("alert", "alert_closed"):
        return "alerts"
    return "stages" if kind.startswith(STAGE) else "other events"


def _count(events: Sequence[Line], group: str) -> int:
    return sum(group_of(e) == group for e in events)


def _journal(recording: Recording, settings: WatchSettings, out: Path, stack: ExitStack) -> Journal:
    journal = Journal(out / JOURNAL)
    stack.callback(journal.close)
    source_facts = {k: v for k, v in recording.facts().items() if k in ("source", "fps", "size")}
    journal.note(
        **source_facts,
        visup=__version__,
        settings=to_jsonable(settings),
        replayed=str(recording.path),
    )
    return journal

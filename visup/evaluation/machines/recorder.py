"""Records the reports of a supervisor for a clip; an observer."""

from __future__ import annotations

import statistics
import time
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations

from visup.agent import Event, Frame, Mind, Presence, Severity, Truth, Verdict
from visup.agent.model.step import Step
from visup.evaluation.machines.scores import (
    Box,
    Interval,
    MachineReport,
    ReportedAlert,
    ReportedStage,
)
from visup.rules.predicates.snapshot import Snapshot
from visup.rules.predicates.vocabulary import PREDICATES
from visup.runs.wiring import final_verdict

MAX_BRIDGED_S = 0.5
"""Shorter breaks of a contact or movement are bridged, seconds: annotators do not notice them either."""

MIN_INTERVAL_S = 0.3
"""Shorter contacts and movements are ignored, seconds."""


@dataclass(slots=True)
class IntervalLog:
    """Intervals from single moments.

    Attributes:
        spans: Names -> [begin, end] of each interval, seconds.
    """

    spans: dict[tuple[str, ...], list[list[float]]] = field(default_factory=dict)

    def add(self, names: tuple[str, ...], now: float) -> None:
        """Add a moment, not before the last one."""
        spans = self.spans.setdefault(names, [])
        if spans and now - spans[-1][1] <= MAX_BRIDGED_S:
            spans[-1][1] = now
        else:
            spans.append([now, now])

    def intervals(self) -> tuple[Interval, ...]:
        """All intervals that are long enough, by names and time."""
        intervals = (
            (names, begin, end)
            for names, spans in sorted(self.spans.items())
            for begin, end in spans
        )
        return tuple(
            Interval(names, begin, end)
            for names, begin, end in intervals
            if end - begin >= MIN_INTERVAL_S
        )


@dataclass(slots=True)
class MachineRecorder:
    """The reports of the supervisor for one clip, frame by frame.

    Attributes:
        others: Names of taught things that are no actors.
    """

    others: Collection[str] = ()
    boxes: dict[int, dict[str, Box]] = field(default_factory=dict)
    contacts: IntervalLog = field(default_factory=IntervalLog)
    moves: IntervalLog = field(default_factory=IntervalLog)
    events: list[Event] = field(default_factory=list)
    alerts: list[ReportedAlert] = field(default_factory=list)
    interrupted_in: str | None = None
    last: Mind | None = None
    _clock: float = field(default_factory=time.perf_counter)
    _step_seconds: list[float] = field(default_factory=list)

    def __call__(self, step: Step, frame: Frame) -> None:
        """Add one step."""
        now = time.perf_counter()
        self._step_seconds.append(now - self._clock)
        mind = step.mind
        object_ids = dict(actor_objects(mind, self.others))
        self.boxes[step.frame_index] = {
            name: mind.objects[i].region.bbox
            for name, i in object_ids.items()
            if mind.objects[i].last_seen == step.time and mind.objects[i].presence is Presence.SEEN
        }
        for pair in touching(mind, object_ids):
            self.contacts.add(pair, step.time)
        for name in moving(mind, object_ids):
            self.moves.add((name,), step.time)
        self.events += [e for e in step.events if e.kind.startswith("stage_")]
        self.alerts += [
            ReportedAlert(a.kind, a.key.rpartition("/")[2], a.opened)
            for a in step.alerts
            if a.closed is None and a.severity >= Severity.WARNING
        ]
        self._note_interruption(mind)
        self.last = mind
        self._clock = time.perf_counter()

    def _note_interruption(self, mind: Mind) -> None:
        """Record the stage in which the task was interrupted: the last active one."""
        task = mind.tasks[0] if mind.tasks else None
        if task and task.verdict is Verdict.INTERRUPTED and self.interrupted_in is None:
            before = self.last.tasks[0] if self.last and self.last.tasks else task
            self.interrupted_in = before.current or task.current or ""

    def report(self) -> MachineReport:
        """The complete report."""
        verdict = final_verdict(self.last) if self.last else Verdict.UNKNOWN
        return MachineReport(
            verdict=verdict.value,
            stages=reported_stages(self.events, self._unsafe_stage(verdict)),
            boxes=self.boxes,
            contacts=self.contacts.intervals(),
            moves=self.moves.intervals(),
            alerts=tuple(self.alerts),
            seconds=self.last.time if self.last else 0.0,
            ms=1000 * statistics.median(self._step_seconds) if self._step_seconds else None,
        )

    def _unsafe_stage(self, verdict: Verdict) -> str | None:
        return self.interrupted_in if verdict is Verdict.INTERRUPTED else None


def actor_objects(mind: Mind, others: Collection[str]) -> Iterator[tuple[str, int]]:
    """Names of actors and other taught things, with their objects."""
    bound: dict[str, int] = {}
    for task in mind.tasks:
        bound |= {b.actor: b.object_id for b in task.bindings if b.object_id in mind.objects}  # type: ignore[misc]  # an id that is known is not None
    yield from bound.items()
    for name in others:
        candidates = [b for b in mind.present() if b.name == name and b.id not in bound.values()]
        if candidates and name not in bound:
            yield name, max(candidates, key=lambda b: (b.strength, -b.id)).id


def touching(mind: Mind, object_ids: Mapping[str, int]) -> Iterator[tuple[str, str]]:
    """Ordered pairs of names whose objects are believed to touch."""
    for (a, i), (b, j) in combinations(sorted(object_ids.items()), 2):
        if mind.truth("in_contact", i, j) is Truth.TRUE:
            yield a, b


def moving(mind: Mind, object_ids: Mapping[str, int]) -> Iterator[str]:
    """Names whose objects are believed to move."""
    facts = Snapshot(mind)
    codes = PREDICATES["moving"].evaluate(facts)
    for name, i in sorted(object_ids.items()):
        if i in facts.row and codes[facts.row[i]] == 1:
            yield name


def reported_stages(
    events: Sequence[Event], unsafe_stage: str | None = None
) -> tuple[ReportedStage, ...]:
    """The reported stages: beginning and final outcome of each.

    Args:
        events: Stage events by time.
        unsafe_stage: The stage in which the task was interrupted, or None.

    Returns:
        One for each reported beginning of a stage; it is complete unless it was last reported to fail or to
        make no progress.
    """
    stages: list[ReportedStage] = []
    for event in events:
        name = str(event.data.get("stage", ""))
        index = next((k for k in reversed(range(len(stages))) if stages[k].stage == name), None)
        if event.kind == "stage_started":
            stages.append(ReportedStage(name, event.time, "complete", event.data.get("began")))
        elif index is not None and event.kind in _OUTCOMES:
            stages[index] = replace(stages[index], outcome=_OUTCOMES[event.kind])
    last = next((k for k in reversed(range(len(stages))) if stages[k].stage == unsafe_stage), None)
    if last is not None:
        stages[last] = replace(stages[last], outcome="unsafe")
    return tuple(stages)


_OUTCOMES = {
    "stage_progressing": "complete",
    "stage_done": "complete",
    "stage_stalled": "failing",
    "stage_failing": "failing",
    "stage_failed": "failing",
}

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

BRIDGED_S = 0.5
"""Shorter breaks of a contact or movement are bridged, seconds: annotators do not notice them either."""

SHORTEST_S = 0.3
"""Shorter contacts and movements are ignored, seconds."""


@dataclass(slots=True)
class IntervalLog:
    """Intervals from single moments.

    Attributes:
        spans: Names -> [begin, end] of each interval, seconds.
    """

    spans: dict[tuple[str, ...], list[list[float]]] = field(default_factory=dict)

    def add(self, who: tuple[str, ...], now: float) -> None:
        """Add a moment, not before the last one."""
        spans = self.spans.setdefault(who, [])
        if spans and now - spans[-1][1] <= BRIDGED_S:
            spans[-1][1] = now
        else:
            spans.append([now, now])

    def intervals(self) -> tuple[Interval, ...]:
        """All intervals that are long enough, by names and time."""
        found = ((who, a, b) for who, spans in sorted(self.spans.items()) for a, b in spans)
        return tuple(Interval(who, a, b) for who, a, b in found if b - a >= SHORTEST_S)


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
    _times: list[float] = field(default_factory=list)

    def __call__(self, step: Step, frame: Frame) -> None:
        """Add one step."""
        now = time.perf_counter()
        self._times.append(now - self._clock)
        mind = step.mind
        who = dict(actor_objects(mind, self.others))
        self.boxes[step.frame_index] = {
            name: mind.objects[i].region.bbox
            for name, i in who.items()
            if mind.objects[i].last_seen == step.time and mind.objects[i].presence is Presence.SEEN
        }
        for pair in touching(mind, who):
            self.contacts.add(pair, step.time)
        for name in moving(mind, who):
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
            stages=told_stages(self.events, self._unsafe(verdict)),
            boxes=self.boxes,
            contacts=self.contacts.intervals(),
            moves=self.moves.intervals(),
            alerts=tuple(self.alerts),
            seconds=self.last.time if self.last else 0.0,
            ms=1000 * statistics.median(self._times) if self._times else None,
        )

    def _unsafe(self, verdict: Verdict) -> str | None:
        return self.interrupted_in if verdict is Verdict.INTERRUPTED else None


def actor_objects(mind: Mind, others: Collection[str]) -> Iterator[tuple[str, int]]:
    """Names of actors and other taught things, with their objects."""
    bound: dict[str, int] = {}
    for task in mind.tasks:
        bound |= {b.actor: b.object_id for b in task.bindings if b.object_id in mind.objects}  # type: ignore[misc]  # an id that is known is not None
    yield from bound.items()
    for name in others:
        like = [b for b in mind.present() if b.name == name and b.id not in bound.values()]
        if like and name not in bound:
            yield name, max(like, key=lambda b: (b.strength, -b.id)).id


def touching(mind: Mind, who: Mapping[str, int]) -> Iterator[tuple[str, str]]:
    """Ordered pairs of names whose objects are believed to touch."""
    for (a, i), (b, j) in combinations(sorted(who.items()), 2):
        if mind.truth("in_contact", i, j) is Truth.TRUE:
            yield a, b


def moving(mind: Mind, who: Mapping[str, int]) -> Iterator[str]:
    """Names whose objects are believed to move."""
    facts = Snapshot(mind)
    codes = PREDICATES["moving"].evaluate(facts)
    for name, i in sorted(who.items()):
        if i in facts.row and codes[facts.row[i]] == 1:
            yield name


def told_stages(events: Sequence[Event], unsafe: str | None = None) -> tuple[ReportedStage, ...]:
    """The reported stages: beginning and final outcome of each.

    Args:
        events: Stage events by time.
        unsafe: The stage in which the task was interrupted, or None.

    Returns:
        One for each reported beginning of a stage; it is complete unless it was last reported to fail or to
        make no progress.
    """
    told: list[ReportedStage] = []
    for event in events:
        name = str(event.data.get("stage", ""))
        at = next((k for k in reversed(range(len(told))) if told[k].stage == name), None)
        if event.kind == "stage_started":
            told.append(ReportedStage(name, event.time, "complete", event.data.get("began")))
        elif at is not None and event.kind in _OUTCOMES:
            told[at] = replace(told[at], outcome=_OUTCOMES[event.kind])
    last = next((k for k in reversed(range(len(told))) if told[k].stage == unsafe), None)
    if last is not None:
        told[last] = replace(told[last], outcome="unsafe")
    return tuple(told)


_OUTCOMES = {
    "stage_progressing": "complete",
    "stage_done": "complete",
    "stage_stalled": "failing",
    "stage_failing": "failing",
    "stage_failed": "failing",
}

"""Scripted minds: what holds between objects over time, written down, as tests need it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, cached_property
from types import MappingProxyType

import numpy as np

from visup.agent import (
    Alert,
    Candidate,
    Event,
    Mind,
    ObjectBelief,
    Observation,
    Outcome,
    Presence,
    Reasoner,
    Region,
    Relation,
    Severity,
    TaskBelief,
    Truth,
)
from visup.agent.model.relation_table import RelationTable
from visup.rules.relations.kinematics import Kinematics
from visup.rules.relations.reasoner import RELATIONS, RelationMemory
from visup.rules.relations.rows import PairQuantity
from visup.tasks import load_task, parse_task
from visup.tasks.supervision.supervise import task_reasoner

DOCK = load_task("dock")

FPS = 5.0
"""Of most plays: a step takes milliseconds, and what is supervised is told alike at any rate."""
ARM, SATELLITE, INTRUDER = 1, 2, 3
IDENTITIES: Mapping[int, Mapping[str, float]] = {
    ARM: {"arm": 0.7, "guitar": 0.3},
    SATELLITE: {"satellite": 0.6, "umbrella": 0.2, "arm": 0.2},
    INTRUDER: {"dish": 0.8, "umbrella": 0.2},
}
REGION = Region(
    id=1,
    bbox=(0, 0, 2, 2),
    mask=np.ones((2, 2), dtype=bool),
    contour=np.zeros((4, 2), dtype=np.float32),
    centroid=(0.5, 0.5),
    area=4.0,
)


@dataclass(frozen=True)
class RelationSpan:
    """A relation that is true from one time to another; `objects` in any order."""

    name: str
    from_s: float
    to_s: float
    objects: tuple[int, ...] = (ARM, SATELLITE)
    truth: Truth = Truth.TRUE
    confidence: float = 1.0


@dataclass(frozen=True)
class Script:
    """A scene over time. What no spell names is false for any pair that both can be seen.

    `gaps` gives the pixels between the arm and the satellite at each time, NaN where nobody knows.
    """

    spans: Sequence[RelationSpan] = ()
    objects: Mapping[int, tuple[float, float]] = field(
        default_factory=lambda: {ARM: (0.0, 1e9), SATELLITE: (0.0, 1e9)}
    )
    hidden: Mapping[int, tuple[float, float]] = field(default_factory=dict)
    identities: Mapping[int, Mapping[str, float]] = field(default_factory=lambda: IDENTITIES)
    alerts: Sequence[tuple[str, float, float]] = ()
    gaps: Callable[[float], float] | None = None
    about: tuple[int, ...] = ()
    actors: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    known: Sequence[str] = (
        "converging",
        "diverging",
        "keeping_distance",
        "touching",
        "coupled",
        "moving_together",
    )

    @cached_property
    def spans_of_relation(self) -> Mapping[tuple[str, frozenset[int]], Sequence[RelationSpan]]:
        """The spells of each relation between the same objects."""
        found: dict[tuple[str, frozenset[int]], list[RelationSpan]] = {}
        for span in self.spans:
            found.setdefault((span.name, frozenset(span.objects)), []).append(span)
        return found


def belief(
    number: int,
    shares: Mapping[str, float],
    presence: Presence = Presence.SEEN,
    confirmed: bool = True,
    seen: tuple[float, float] = (0.0, 0.0),
) -> ObjectBelief:
    ranked = sorted(shares.items(), key=lambda item: -item[1])
    candidates = tuple(Candidate(n, s * 10, s) for n, s in ranked)
    return ObjectBelief(number, REGION, presence, *seen, confirmed, candidates)


def mind_at(script: Script, time: float, index: int, before: Mind) -> Mind:
    """The mind that a script has at one time, with the memory of the one before."""
    objects = {}
    for number, (enters, leaves) in script.objects.items():
        if time < enters:
            continue
        hides, shows = script.hidden.get(number, (1e9, 1e9))
        hidden = hides <= time < shows
        presence = Presence.HIDDEN if hidden else Presence.SEEN
        if time >= leaves:
            presence = Presence.LEFT
        objects[number] = belief(
            number, script.identities.get(number, {}), presence, seen=(enters, min(time, leaves))
        )
    alerts = tuple(
        Alert(i, kind, Severity.WARNING, opened, time, script.about, f"There is a {kind}.")
        for i, (kind, opened, closed) in enumerate(script.alerts, 1)
        if opened <= time < closed
    )
    if script.gaps is not None:
        before = before.remember(RELATIONS, _measured(script.gaps(time)))
    return replace(
        before,
        time=time,
        frame_index=index,
        objects=MappingProxyType(objects),
        # As a table, which is made once for all that is asked of one mind.
        relations=RelationTable(extra=_relations(script, time, objects)),
        alerts=alerts,
        actors=script.actors,
    )


def _measured(gap: float) -> RelationMemory:
    tables = np.full((5, 2, 2), np.nan)
    tables[PairQuantity.GAP] = [[np.nan, gap], [gap, np.nan]]
    nothing = np.full(2, np.nan)
    known = Kinematics(
        (ARM, SATELLITE), tables, np.full((3, 2, 2), np.nan), nothing, nothing, nothing
    )
    return RelationMemory(measured=known)


def _relations(
    script: Script, time: float, objects: Mapping[int, ObjectBelief]
) -> tuple[Relation, ...]:
    seen = sorted(i for i, b in objects.items() if b.presence is Presence.SEEN)
    found = []
    for i, a in enumerate(seen):
        for b in seen[i + 1 :]:
            found += [_relation(script, name, (a, b), time) for name in script.known]
    return tuple(found)


@cache
def _never(name: str, pair: tuple[int, int]) -> Relation:
    return Relation(name, pair, Truth.FALSE, 0.0)


def _relation(script: Script, name: str, pair: tuple[int, int], time: float) -> Relation:
    spans = script.spans_of_relation.get((name, frozenset(pair)))
    if spans is None:
        return _never(name, pair)
    for span in spans:
        if span.from_s <= time < span.to_s:
            return Relation(name, pair, span.truth, span.from_s, span.confidence)
    ended = [s.to_s for s in spans if s.to_s <= time]
    return Relation(name, pair, Truth.FALSE, max(ended, default=0.0))


@dataclass(frozen=True)
class ScriptedRun:
    """The result of reasoning about a script: all minds and outcomes."""

    minds: tuple[Mind, ...]
    outcomes: tuple[Outcome, ...]

    @property
    def events(self) -> tuple[Event, ...]:
        return tuple(e for o in self.outcomes for e in o.events)

    @property
    def last(self) -> Mind:
        return self.minds[-1]

    def at(self, time: float) -> Mind:
        return next(m for m in self.minds if m.time >= time - 1e-9)

    def reported(self) -> list[tuple[str, str]]:
        return [(e.kind, str(e.data.get("stage", ""))) for e in self.events]


def play(reasoner: Reasoner, script: Script, until: float, fps: float = FPS) -> ScriptedRun:
    """Let a reasoner live through a script."""
    mind, minds, outcomes = Mind(), [], []
    for index in range(round(until * fps) + 1):
        now = mind_at(script, index / fps, index, mind)
        observation = Observation(index, index / fps, (640, 480))
        outcome = reasoner(now, observation)
        mind = outcome.mind
        minds.append(mind)
        outcomes.append(outcome)
    return ScriptedRun(tuple(minds), tuple(outcomes))


def watch(script: Script, until: float, text: str = "", fps: float = FPS) -> ScriptedRun:
    """The play of a task, that of docking unless another is given."""
    return play(task_reasoner([parse_task(text) if text else DOCK]), script, until, fps)


def task_of(played: ScriptedRun, time: float | None = None) -> TaskBelief:
    """What is believed of the only task, at the end or at a time."""
    return (played.last if time is None else played.at(time)).tasks[0]


RETRIES = (
    RelationSpan("converging", 0, 5),
    RelationSpan("diverging", 6, 10),
    RelationSpan("converging", 11, 15),
    RelationSpan("diverging", 16, 18),
    RelationSpan("converging", 19, 25),
    RelationSpan("touching", 25, 40),
    RelationSpan("coupled", 26, 40),
)
"""Two attempts at a capture that are broken off, and a third one that succeeds."""

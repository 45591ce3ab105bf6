"""Runs of the reasoners over observations, for tests."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from types import MappingProxyType

from visup.agent import (
    AlertCondition,
    Binding,
    Event,
    Expectation,
    Mind,
    Observation,
    Outcome,
    Reasoner,
    TaskBelief,
    Verdict,
)
from visup.rules.reasoners import default_reasoners


@dataclass(frozen=True)
class Thought:
    mind: Mind
    events: tuple[Event, ...]
    conditions: tuple[AlertCondition, ...]


def think(
    reasoners: Iterable[Reasoner],
    observations: Iterable[Observation],
    actors: dict[str, tuple[str, ...]] | None = None,
) -> Iterator[Thought]:
    """What an agent concludes, step by step, from reasoners alone."""
    mind = Mind(actors=MappingProxyType(actors or {}))
    chain = tuple(reasoners)
    for seen in observations:
        mind = replace(
            mind, time=seen.time, frame_index=seen.frame_index, frame_size=seen.frame_size
        )
        events: tuple[Event, ...] = ()
        concerns: tuple[AlertCondition, ...] = ()
        for reasoner in chain:
            outcome = reasoner(mind, seen)
            mind, events = outcome.mind, events + outcome.events
            concerns += outcome.conditions
        yield Thought(mind, events, concerns)


def reason(
    observations: Iterable[Observation],
    *more: Reasoner,
    actors: dict[str, tuple[str, ...]] | None = None,
) -> list[Thought]:
    """What the reasoners of rules/ conclude, and any more after them."""
    rules = default_reasoners()
    return list(think((*rules.update, *rules.cogitate, *more), observations, actors))


def events_of(thoughts: Iterable[Thought], kinds: Iterable[str]) -> list[tuple[str, int, float]]:
    """(kind, first object, seconds) of the events of some kinds."""
    wanted = frozenset(kinds)
    events = (e for t in thoughts for e in t.events if e.kind in wanted)
    return [(e.kind, e.objects[0], e.time) for e in events]


def dock(mind: Mind, observation: Observation) -> Outcome:
    """A stand-in for task supervision: the arm shall come to the satellite, nobody else may."""
    playing = {
        actor: next((b for b in mind.present() if b.name in models), None)
        for actor, models in mind.actors.items()
    }
    bindings = tuple(
        Binding(actor, mind.actors[actor], b.id if b else None, b.strength if b else 0.0)
        for actor, b in playing.items()
    )
    explained = {b.object_id for b in bindings}
    known = all(b.object_id is not None for b in bindings)
    pair = tuple(b.object_id for b in bindings if b.object_id is not None)
    task = TaskBelief(
        "dock",
        Verdict.IN_PROGRESS,
        bindings=bindings,
        expected=(Expectation("coupled", pair),) if known else (),
        unexplained=tuple(b.id for b in mind.present() if b.id not in explained) if known else (),
    )
    return Outcome(replace(mind, tasks=(task,)))

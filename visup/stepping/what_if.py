"""What-if branches: enforced beliefs, and other rules or tasks.

A belief is enforced after every reasoner in every step, because measurements keep contradicting it; later
reasoners of the step use it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

from visup.agent import (
    Candidate,
    Coupling,
    Event,
    Mind,
    Observation,
    Outcome,
    Presence,
    Reasoner,
    Relation,
    RelationTable,
    Truth,
)
from visup.agent.cycle.agent import Reasoners
from visup.agent.model.object_beliefs import UNKNOWN_OBJECT
from visup.agent.model.relation_columns import UNKNOWN_CODE, ColumnLayout, RelationBlock
from visup.rules.formula.nodes import Rule
from visup.rules.safety.reasoner import RuleReasoner
from visup.tasks.supervision.supervise import MEMORY, task_reasoner

if TYPE_CHECKING:
    from visup.tasks.grammar.nodes import Task

Assumption = Callable[[Mind], Mind]
"""Returns a mind in which the assumption holds; its objects may not exist."""


@dataclass(frozen=True, slots=True)
class AssumedRelation:
    """A relation is true, false or unknown since a time in seconds.

    For mutually exclusive relations (converging, keeping their distance, diverging), a false one makes an
    adjacent one true.
    """

    name: str
    objects: tuple[int, ...]
    truth: Truth
    since: float

    def __call__(self, mind: Mind) -> Mind:
        """See `Assumption`."""
        if not all(i in mind.objects for i in self.objects):
            return mind
        found = mind.relation(self.name, *self.objects)
        if found is None or found.truth is not self.truth:
            assumed = Relation(self.name, self.objects, self.truth, self.since)
            mind = replace(mind, relations=with_relation(mind.relations, assumed))
        return self._coupled(mind) if self.name == "coupled" else mind

    def _coupled(self, mind: Mind) -> Mind:
        """Couplings are also stored separately from the relations."""
        low, high = sorted(self.objects)
        others = tuple(c for c in mind.couplings if c.objects != (low, high))
        if self.truth is not Truth.TRUE:
            return replace(mind, couplings=others)
        if len(others) < len(mind.couplings):
            return mind
        return replace(mind, couplings=(*others, Coupling((low, high), self.since)))


@dataclass(frozen=True, slots=True)
class AssumedIdentity:
    """An object has the identity of a model; 'unknown object' for none."""

    object_id: int
    name: str

    def __call__(self, mind: Mind) -> Mind:
        """See `Assumption`."""
        belief = mind.objects.get(self.object_id)
        if belief is None or (belief.name == self.name and belief.confidence == 1.0):
            return mind
        unidentified = self.name == UNKNOWN_OBJECT
        names = () if unidentified else (Candidate(self.name, 0.0, 1.0, 1.0),)
        return mind.with_objects(replace(belief, candidates=names, unknown=float(unidentified)))


@dataclass(frozen=True, slots=True)
class AssumedPresence:
    """An object is seen, hidden, or has left."""

    object_id: int
    presence: Presence

    def __call__(self, mind: Mind) -> Mind:
        """See `Assumption`."""
        belief = mind.objects.get(self.object_id)
        if belief is None or belief.presence is self.presence:
            return mind
        return mind.with_objects(replace(belief, presence=self.presence))


@dataclass(frozen=True, slots=True)
class AssumingReasoner:
    """A reasoner wrapped to enforce beliefs after it."""

    reasoner: Reasoner
    beliefs: tuple[Assumption, ...]

    def __call__(self, mind: Mind, observation: Observation) -> Outcome:
        """See `Reasoner`."""
        outcome = self.reasoner(mind, observation)
        events = tuple(
            e for e in outcome.events if not any(_contradicts(b, e) for b in self.beliefs)
        )
        return replace(outcome, mind=with_assumptions(outcome.mind, self.beliefs), events=events)


def _contradicts(belief: Assumption, event: Event) -> bool:
    """Whether an event contradicts an assumption."""
    if not isinstance(belief, AssumedRelation) or belief.name != "coupled":
        return False
    other = "decoupled" if belief.truth is Truth.TRUE else "coupled"
    return event.kind == other and set(event.objects) == set(belief.objects)


def with_assumptions(mind: Mind, beliefs: Iterable[Assumption]) -> Mind:
    """The mind with the assumptions enforced."""
    for belief in beliefs:
        mind = belief(mind)
    return mind


def assuming_reasoners(reasoners: Reasoners, beliefs: Sequence[Assumption]) -> Reasoners:
    """Reasoners wrapped to enforce beliefs."""
    if not beliefs:
        return reasoners

    def wrapped(some: tuple[Reasoner, ...]) -> tuple[Reasoner, ...]:
        return tuple(AssumingReasoner(t, tuple(beliefs)) for t in some)

    return Reasoners(*(wrapped(some) for _, some in reasoners.by_phase()))


def with_rules(reasoners: Reasoners, rules: Sequence[Rule]) -> Reasoners:
    """Reasoners with other rules."""
    others = tuple(t for t in reasoners.cogitate if not isinstance(t, RuleReasoner))
    early = any(t.early for t in reasoners.cogitate if isinstance(t, RuleReasoner))
    return replace(reasoners, cogitate=(*others, RuleReasoner(tuple(rules), early=early)))


def with_tasks(reasoners: Reasoners, tasks: Sequence[Task]) -> Reasoners:
    """Reasoners with other tasks, from their beginnings."""
    others = tuple(
        t for t in reasoners.match if getattr(t, "__module__", "") != task_reasoner.__module__
    )
    return replace(reasoners, match=(*((task_reasoner(tasks),) if tasks else ()), *others))


def without_tasks(mind: Mind) -> Mind:
    """The mind without any task beliefs."""
    memory = {k: v for k, v in mind.memory.items() if k != MEMORY.name}
    return replace(mind, tasks=(), memory=MappingProxyType(memory))


def with_relation(
    relations: RelationTable | tuple[Relation, ...], assumed: Relation
) -> RelationTable | tuple[Relation, ...]:
    """Relations with one replaced as assumed."""
    if not isinstance(relations, RelationTable):
        return (*_others(relations, assumed), assumed)
    for number, cells in enumerate(relations.parts):
        if assumed.name in cells.columns.named:
            k, row = relations.pair(*assumed.objects) if len(assumed.objects) == 2 else (-1, 0)
            if k < 0:
                return relations
            parts = list(relations.parts)
            parts[number] = _with_cell(cells, assumed, row, k)
            return replace(relations, parts=tuple(parts))
    return replace(relations, extra=(*_others(relations.extra, assumed), assumed))


def _others(relations: Iterable[Relation], assumed: Relation) -> tuple[Relation, ...]:
    objects = frozenset(assumed.objects)
    return tuple(r for r in relations if r.name != assumed.name or frozenset(r.objects) != objects)


def _with_cell(cells: RelationBlock, assumed: Relation, row: int, k: int) -> RelationBlock:
    column, code = cells.columns.named[assumed.name]
    if assumed.truth is Truth.UNKNOWN:
        code = UNKNOWN_CODE
    elif assumed.truth is Truth.FALSE:
        others = [c for c in range(len(column.names)) if c != code]
        # Prefer a code without a name, which implies nothing else; otherwise an adjacent one.
        code = min(others, key=lambda c: (column.names[c] != "", abs(c - code)))
    state, since, at = cells.state.copy(), cells.since.copy(), column.rows[row]
    state[at, k], since[at, k] = code, assumed.since
    # The confidence row may be shared with other columns: this one gets a row of its own.
    numbers = np.concatenate([cells.numbers, cells.numbers[column.confidence][None]])
    numbers[-1, k] = assumed.confidence
    own_row = replace(column, confidence=len(numbers) - 1)
    layout = tuple(own_row if c is column else c for c in cells.columns.each)
    return RelationBlock(ColumnLayout(layout), state, since, numbers)

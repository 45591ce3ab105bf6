"""`gripper of arm` in place of an actor declares the actor `gripper` as a part of `arm`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from visup.rules.formula.nodes import Comparison
from visup.tasks.grammar.conditions import Action, Condition, PartName, actors_of, facts_of
from visup.tasks.grammar.criteria import PartOf, in_order
from visup.tasks.grammar.nodes import Actor, Actors, Conditioned, Invariant, Stage, walk


def with_parts(
    declared: Sequence[Actor], stages: Sequence[Stage], invariants: Sequence[Invariant]
) -> tuple[Actor, ...]:
    """The declarations of actors, including the parts declared in conditions.

    Args:
        declared: The declarations of a file.
        stages: Its stages.
        invariants: Its invariants.
    """
    actors = list(declared)
    for name in _parts(stages, invariants):
        part = PartOf(name.machine, name.span)
        at = next((k for k, a in enumerate(actors) if a.name == name), None)
        if at is None:
            actors.append(Actor(str(name), span=name.span, criteria=(part,)))
        elif part not in actors[at].criteria:
            criteria = in_order((*actors[at].criteria, part))
            actors[at] = replace(actors[at], criteria=criteria)
    return tuple(actors)


def _parts(stages: Sequence[Stage], invariants: Sequence[Invariant]) -> Iterator[PartName]:
    for fact in _facts(stages, invariants):
        yield from (n for n in actors_of(fact) if isinstance(n, PartName))


def _facts(
    stages: Sequence[Stage], invariants: Sequence[Invariant]
) -> Iterator[Action | Comparison]:
    for stage in stages:
        for node in () if isinstance(stage.body, Actors) else walk(stage.body):
            if isinstance(node, Action | Comparison):
                yield node
            elif isinstance(node, Conditioned):
                yield from _facts_of(s.condition for s in node.conditions)
    yield from _facts_of(i.condition for i in invariants)


def _facts_of(conditions: Iterator[Condition]) -> Iterator[Action | Comparison]:
    for condition in conditions:
        yield from facts_of(condition)

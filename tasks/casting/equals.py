"""Casting among objects that look the same: which of them is meant is told by what happens to them.

Of two equal parts on a table the task is about the one that the gripper goes to. An actor is first given to
the best match. As long as nothing has happened to that object, the actor passes to an equal one to which more
happens; once another actor has met or held its object, it stays with that.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from enum import IntEnum

from visup.agent import Binding, Mind, ObjectBelief, Presence, Truth
from visup.agent.model.fast_replace import replace
from visup.tasks.casting.exclusion import moves
from visup.tasks.casting.fitness import strength
from visup.tasks.grammar.nodes import Task
from visup.tasks.verification.settings import TaskSettings

EQUAL_SHARE = 0.8
"""Least strength of an equal object, relative to the one that plays the actor."""

Settled = frozenset[tuple[str, int]]
"""Actors with objects that they stay with."""


class Encounter(IntEnum):
    """What happens between an object and the other actors, in ascending weight."""

    LEFT_BEHIND = -1
    NOTHING = 0
    APPROACHED = 1
    MET = 2
    HELD = 3


def among_equals(
    bindings: Sequence[Binding], settled: Settled, task: Task, mind: Mind, settings: TaskSettings
) -> tuple[tuple[Binding, ...], Settled]:
    """The bindings, with actors passed to equal objects to which more happens.

    Args:
        bindings: One for each actor.
        settled: The actors that stay with their objects.
        task: The task.
        mind: The mind.
        settings: Provides the share of votes from which on an object counts as known.

    Returns:
        The bindings, and the actors that stay with their objects from now on.
    """
    found = list(bindings)
    for k, binding in enumerate(found):
        mine = binding.object_id
        if mine is None or binding.guessed or (binding.actor, mine) in settled:
            continue
        others = [b.object_id for b in found if b.object_id is not None and b is not binding]
        here = encounter(mine, others, mind)
        rivals = _rivals(binding, found, task, mind, settings) if here < Encounter.MET else []
        happened = [(encounter(o.id, others, mind), -o.id) for o in rivals]
        best, number = max(happened, default=(Encounter.NOTHING, 0))
        if best > max(here, Encounter.NOTHING):
            mine, here = -number, best
            now = strength(mind.objects[mine], binding.models)
            found[k] = replace(binding, object_id=mine, strength=now)
        if here >= Encounter.MET:
            settled |= {(binding.actor, mine)}
    playing = {(b.actor, b.object_id) for b in found}
    return tuple(found), frozenset(s for s in settled if s in playing)


def _rivals(
    binding: Binding,
    bindings: Sequence[Binding],
    task: Task,
    mind: Mind,
    settings: TaskSettings,
) -> list[ObjectBelief]:
    """The objects in view without a role that look as much like an actor as the one that plays it."""
    mine = mind.objects.get(binding.object_id) if binding.object_id is not None else None
    if mine is None or not binding.models or mine.id in mind.answers:
        return []
    if task.actor(binding.actor).criteria:
        return []  # the user has said which of them is meant
    playing = {b.object_id for b in bindings}
    least = max(settings.familiar, EQUAL_SHARE * strength(mine, binding.models))
    return [
        o
        for o in mind.objects.values()
        if o.id not in playing
        and o.confirmed
        and o.presence is Presence.SEEN
        and strength(o, binding.models) >= least
    ]


def encounter(object_id: int, others: Collection[int], mind: Mind) -> Encounter:
    """The weightiest encounter of an object with other ones; only what moves approaches, meets or leaves."""
    found = [_encounter(object_id, other, mind) for other in others]
    best = max(found, default=Encounter.NOTHING)
    return best if best > Encounter.NOTHING else min(found, default=Encounter.NOTHING)


def _encounter(object_id: int, other: int, mind: Mind) -> Encounter:
    pair = (object_id, other)
    if mind.truth("coupled", *pair) is Truth.TRUE:
        return Encounter.HELD
    if not any(moves(i, mind) for i in pair):
        return Encounter.NOTHING
    for name, encounter in _ENCOUNTERS.items():
        if mind.truth(name, *pair) is Truth.TRUE:
            return encounter
    return Encounter.NOTHING


_ENCOUNTERS = {
    "in_contact": Encounter.MET,
    "converging": Encounter.APPROACHED,
    "diverging": Encounter.LEFT_BEHIND,
}

"""Judging back in time: what was seen before an actor was found counts once it is found.

While an actor of a task is looked for, the task keeps what was seen, thinned out and for a bounded time.
When an object is found to play the actor, that time is gone through again with it: the task filter starts
from what it believed at its beginning and takes each look as it would have, had it known then. So
nothing is weighed twice, and a stage that has passed by then is judged by what was seen of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from types import MappingProxyType

from visup.agent import Binding, Mind
from visup.agent.model.fast_replace import replace
from visup.rules.relations.reasoner import RELATIONS, RelationMemory
from visup.rules.relations.zones import ZONES
from visup.tasks.supervision.hypotheses import TaskHypotheses
from visup.tasks.supervision.monitored_phases import MonitoredPhases
from visup.tasks.supervision.snapshot import TaskSnapshot
from visup.tasks.verification.kept import NOTHING_KEPT, Kept

KEPT_S = 60.0
"""For how long what was seen is kept."""

EVERY_S = 0.4
"""How far apart the looks are that are kept: as far as those that the task filter weighs."""

LONGEST_STEP_S = 1.0
"""A gap in the frames counts as no more than this."""


@dataclass(frozen=True, eq=False)
class PastLook:
    """The beliefs at one moment while an actor was being searched for.

    Attributes:
        mind: What was believed of the objects, without what nobody asks for later.
        posterior: The hypotheses about the task before that look.
        kept: What was kept of its facts before it.
    """

    mind: Mind
    posterior: TaskHypotheses | None
    kept: Kept = NOTHING_KEPT


def remembered(
    looks: tuple[PastLook, ...],
    mind: Mind,
    posterior: TaskHypotheses | None,
    kept: Kept,
) -> tuple[PastLook, ...]:
    """The looks with the present one, if it is time for it; the oldest are forgotten.

    Args:
        looks: What was kept so far.
        mind: What is believed now.
        posterior: The hypotheses before this look.
        kept: As of `PastLook`.
    """
    if looks and mind.time - looks[-1].mind.time < EVERY_S - 1e-9:
        return looks
    recent = (p for p in looks if mind.time - p.mind.time <= KEPT_S)
    return (*recent, PastLook(_stripped(mind), posterior, kept))


def newly_found(before: Sequence[Binding], now: Sequence[Binding], mind: Mind) -> bool:
    """Whether an actor was found in an object that had been there before."""
    was = {b.actor: b.object_id for b in before}
    found = [b.object_id for b in now if b.object_id is not None and was.get(b.actor) is None]
    return any(i in mind.objects and mind.objects[i].first_seen < mind.time for i in found)


def replayed(
    model: MonitoredPhases, looks: Sequence[PastLook], bindings: Sequence[Binding]
) -> tuple[TaskHypotheses | None, Kept]:
    """The hypotheses about a task replayed over recent observations, with the casting now known.

    Args:
        model: The task with its filter.
        looks: What was kept, oldest first.
        bindings: Who plays whom, as it is known now.

    Returns:
        The hypotheses, and what is kept of the facts.
    """
    if not looks:
        return None, NOTHING_KEPT
    posterior, kept = looks[0].posterior, looks[0].kept
    for look in looks:
        known = tuple(_as_of(b, look.mind) for b in bindings)
        snapshot = TaskSnapshot(look.mind, known, model, kept)
        posterior = followed(model, posterior, snapshot)
        kept = snapshot.kept
    return posterior, kept


def followed(
    model: MonitoredPhases, posterior: TaskHypotheses | None, snapshot: TaskSnapshot
) -> TaskHypotheses | None:
    """The hypotheses after one look; the task begins once all actors of one of its first steps are found."""
    now = snapshot.mind.time
    if posterior is None:
        found = any(snapshot.found(step.actors) for step in model.first_steps)
        begun = model.filter.start(now)
        return model.filter.step(begun, snapshot.observe, 0.0) if found else None
    dt = min(max(0.0, now - posterior.time), LONGEST_STEP_S)
    return model.filter.step(posterior, snapshot.observe, dt, now)


def _as_of(binding: Binding, mind: Mind) -> Binding:
    """A binding as it would have been: unbound until its object appears."""
    there = binding.object_id in mind.objects
    return binding if there else replace(binding, object_id=None, strength=0.0)


def _stripped(mind: Mind) -> Mind:
    """A mind reduced to what a task requires, so that older minds are not kept alive."""
    kept = RelationMemory(measured=mind.recall(RELATIONS).measured)
    memory = {RELATIONS.name: kept, ZONES.name: mind.recall(ZONES)}
    return replace(
        mind,
        tasks=(),
        alerts=(),
        questions=(),
        percepts=MappingProxyType({}),
        memory=MappingProxyType(memory),
    )

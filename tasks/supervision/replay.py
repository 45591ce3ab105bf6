"""Replays recent observations when an actor is identified late.

While an actor of a task is missing, past beliefs of the mind are stored, thinned out and for a
limited time. When an object is found to be the actor, they are replayed with it: the task filter restarts
from its posterior at the beginning of that time and processes each step with the bindings known now. So
nothing is counted twice, and a stage that has passed meanwhile is judged by its observations.
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
from visup.tasks.verification.observation import NO_MEMORY, ObservationMemory

MEMORY_S = 60.0
"""How long past steps are stored, seconds."""

EVERY_S = 0.4
"""Interval of stored steps, seconds: that of the task filter."""

LONGEST_STEP_S = 1.0
"""Longest time step for a gap in the frames, seconds."""


@dataclass(frozen=True, eq=False)
class PastStep:
    """The beliefs at one moment while an actor was missing.

    Attributes:
        mind: The mind, reduced to what the replay needs.
        posterior: The hypotheses before that step.
        observations: The state of the facts before it.
    """

    mind: Mind
    posterior: TaskHypotheses | None
    observations: ObservationMemory = NO_MEMORY


def remembered(
    past: tuple[PastStep, ...],
    mind: Mind,
    posterior: TaskHypotheses | None,
    observations: ObservationMemory,
) -> tuple[PastStep, ...]:
    """The past steps with the present one if it is due; the oldest are dropped.

    Args:
        past: The past steps so far.
        mind: The present mind.
        posterior: The hypotheses before this step.
        observations: As in `PastStep`.
    """
    if past and mind.time - past[-1].mind.time < EVERY_S - 1e-9:
        return past
    recent = (p for p in past if mind.time - p.mind.time <= MEMORY_S)
    return (*recent, PastStep(_stripped(mind), posterior, observations))


def newly_found(before: Sequence[Binding], now: Sequence[Binding], mind: Mind) -> bool:
    """Whether an unbound actor has been bound to an object that was present before."""
    was = {b.actor: b.object_id for b in before}
    found = [b.object_id for b in now if b.object_id is not None and was.get(b.actor) is None]
    return any(i in mind.objects and mind.objects[i].first_seen < mind.time for i in found)


def replayed(
    model: MonitoredPhases, past: Sequence[PastStep], bindings: Sequence[Binding]
) -> tuple[TaskHypotheses | None, ObservationMemory]:
    """Replay stored steps with the casting known now.

    Args:
        model: The task with its filter.
        past: The past steps, oldest first.
        bindings: The present casting.

    Returns:
        The hypotheses, and the state of the facts.
    """
    if not past:
        return None, NO_MEMORY
    posterior, observations = past[0].posterior, past[0].observations
    for step in past:
        known = tuple(_as_of(b, step.mind) for b in bindings)
        snapshot = TaskSnapshot(step.mind, known, model, observations)
        posterior = followed(model, posterior, snapshot)
        observations = snapshot.memory
    return posterior, observations


def followed(
    model: MonitoredPhases, posterior: TaskHypotheses | None, snapshot: TaskSnapshot
) -> TaskHypotheses | None:
    """The hypotheses after one step; the task begins once all actors of a first step are found."""
    now = snapshot.mind.time
    if posterior is None:
        found = any(snapshot.found(step.actors) for step in model.first_steps)
        begun = model.filter.start(now)
        return model.filter.step(begun, snapshot.observe, 0.0) if found else None
    dt = min(max(0.0, now - posterior.time), LONGEST_STEP_S)
    return model.filter.step(posterior, snapshot.observe, dt, now)


def _as_of(binding: Binding, mind: Mind) -> Binding:
    """A binding at an earlier time: unbound until its object appears."""
    there = binding.object_id in mind.objects
    return binding if there else replace(binding, object_id=None, strength=0.0)


def _stripped(mind: Mind) -> Mind:
    """A mind reduced to what a task requires, so that older minds can be freed."""
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

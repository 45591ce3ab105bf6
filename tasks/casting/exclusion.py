"""Casting by exclusion: a guess until the actor is recognised.

If all actors but one are found and at rest, and a single unknown object moves, it is guessed to be the
missing actor: an arm in a posture that was never taught, a tool seen from behind. A guess yields to
recognition at once, explains no unexpected objects, and never takes an actor from an object.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence

import numpy as np

from visup.agent import Binding, Mind, ObjectBelief, Presence, Region
from visup.agent.model.fast_replace import replace
from visup.rules.geometry.regions import Floats, image_diagonal
from visup.rules.relations.reasoner import kinematics
from visup.tasks.grammar.nodes import Task
from visup.tasks.verification.settings import TaskSettings

MOVES = 0.01
"""Speed from which on an object clearly moves, image diagonals per second."""

SIGMAS = 4.0
"""The speed must also exceed this many standard deviations."""

LARGER = 2.0
"""It must be this many times as large as any other moving object: the shadow of an arm moves, too."""


def guessed(
    task: Task,
    mind: Mind,
    bindings: Sequence[Binding],
    before: Sequence[Binding],
    settings: TaskSettings,
) -> tuple[Binding, ...]:
    """Bindings with a guess for the only missing actor, if justified.

    Args:
        task: The task.
        mind: The mind.
        bindings: Bindings of all actors in order; missing ones have no object.
        before: The bindings of the last step: a guess is kept unless contradicted.
        settings: Provides the share of votes from which on an object counts as known.

    Returns:
        The same bindings, or with the moving object as the missing actor.
    """
    missed = [k for k, b in enumerate(bindings) if b.object_id is None and _told_by_looks(task, b)]
    awaited = [b for b in bindings if b.object_id is None and not task.actor(b.actor).spare]
    if len(missed) != 1 or len(awaited) > 1 or len(bindings) < 2:
        return tuple(bindings)
    (k,) = missed
    playing = {b.object_id for b in bindings if b.object_id is not None}
    unknown = [o for o in mind.present() if o.id not in playing and _unknown(o, settings)]
    was = next((b.object_id for b in before if b.guessed and b.actor == bindings[k].actor), None)
    object_id = next((o.id for o in unknown if o.id == was), None)
    known = [mind.objects[i] for i in playing if i in mind.objects]
    if object_id is None and not any(_movers(known, mind, known)):
        object_id = _only_mover(unknown, mind, known)
    if object_id is None:
        return tuple(bindings)
    binding = replace(bindings[k], object_id=object_id, strength=settings.bind_at, guessed=True)
    return (*bindings[:k], binding, *bindings[k + 1 :])


def _told_by_looks(task: Task, binding: Binding) -> bool:
    """Whether an actor is identified by its models only, and is not optional."""
    actor = task.actor(binding.actor)
    waited = not actor.optional and not actor.spare
    return bool(binding.models) and not actor.criteria and waited


def _unknown(belief: ObjectBelief, settings: TaskSettings) -> bool:
    return (
        belief.confirmed
        and belief.presence is Presence.SEEN
        and (belief.name is None or belief.strength < settings.familiar)
    )


def _only_mover(
    unknown: Collection[ObjectBelief], mind: Mind, known: Sequence[ObjectBelief]
) -> int | None:
    """The moving object that is much larger than all other moving ones, or None."""
    movers = sorted(_movers(unknown, mind, known), reverse=True)
    if not movers or (len(movers) > 1 and movers[0][0] < LARGER * movers[1][0]):
        return None
    return movers[0][1]


def _movers(
    objects: Collection[ObjectBelief], mind: Mind, known: Sequence[ObjectBelief]
) -> Iterator[tuple[float, int]]:
    """Area and id of moving objects."""
    scene = np.mean([o.region.velocity for o in known], axis=0)
    for o in objects:
        if moves(o.id, mind) or _sets_out(o.region, scene, mind):
            yield o.region.area, o.id


def moves(object_id: int, mind: Mind) -> bool:
    """Whether an object has been moving for a while."""
    now = kinematics(mind)
    noise = SIGMAS * now.one("velocity_sigma", object_id)
    return now.one("speed", object_id) > max(MOVES * image_diagonal(mind.frame_size), noise)


def _sets_out(region: Region, scene: Floats, mind: Mind) -> bool:
    """Whether a region moves relative to the resting scene, even if it appeared only recently."""
    if region.velocity_sigma <= 0.0:
        return False
    speed = float(np.hypot(region.velocity[0] - scene[0], region.velocity[1] - scene[1]))
    return speed > max(MOVES * image_diagonal(mind.frame_size), SIGMAS * region.velocity_sigma)

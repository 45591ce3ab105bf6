"""The fitness of objects for an actor, by its models and criteria.

Criteria are a conjunction, so the fitness is the minimum over them. Orders (`the leftmost`) are evaluated
last, among the objects that fit everything else.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import assert_never

from visup.agent import Mind, ObjectBelief
from visup.rules.geometry.regions import image_diagonal
from visup.rules.relations.reasoner import kinematics
from visup.rules.traits.colours import colour_share
from visup.rules.traits.reasoner import NO_TRAITS, Traits, traits_of
from visup.tasks.grammar.criteria import (
    Another,
    Colours,
    Conduct,
    Criterion,
    Extent,
    OtherModels,
    PartOf,
    Place,
    Ranked,
)
from visup.tasks.grammar.nodes import Task
from visup.tasks.grammar.structure import task_actors
from visup.tasks.grammar.units import value

COLOURED = (0.2, 0.6)
"""Shares of an object's pixels of a colour for fitness 0 and 1: held objects, shadows and highlights are part
of most outlines."""

PLACED = (0.01, 0.08)
"""Distances from an outline to a position for fitness 1 and 0, image diagonals."""

HANGS = (0.006, 0.02)
"""Distances of a part from its machine for fitness 1 and 0, image diagonals."""

SIZE_SHARE = 0.1
"""Relative tolerance of a size comparison."""

CONTENDS = 0.3
"""Least fitness by the other criteria for an object to be ranked."""

LATE_S = 5.0
"""An actor ranked by position is not taken over by objects that appeared this much later, seconds."""

NOT_FIRST = 0.95
"""Weight of `another`: the actor without it takes precedence if there is only one object for both."""

REST_S = 1.0
"""Time without motion after which an object is at rest, seconds."""


@dataclass(frozen=True, slots=True)
class Role:
    """An actor to be cast.

    Attributes:
        task: The task.
        actor: The actor.
        mind: The mind.
        playing: Actor -> its object so far, for this actor and for machines.
    """

    task: Task
    actor: str
    mind: Mind
    playing: Mapping[str, int]


def fits(role: Role, models: Sequence[str], objects: Sequence[ObjectBelief]) -> list[float]:
    """The fitness of each object for an actor, 0 to 1.

    Args:
        role: The actor.
        models: The models that it may be; empty for one identified only by criteria.
        objects: The objects.
    """
    criteria = role.task.actor(role.actor).criteria
    looked = [strength(o, models) if models else 1.0 for o in objects]
    if not criteria:
        return _answered(looked, role, objects)
    known = [traits_of(role.mind, o.id) or NO_TRAITS for o in objects]
    plain = [c for c in criteria if not isinstance(c, Ranked)]
    fit = [
        min([looks, *(_meets(c, role, o, t) for c in plain)])
        for looks, o, t in zip(looked, objects, known, strict=True)
    ]
    for criterion in criteria:
        if isinstance(criterion, Ranked):
            fit = _ranked(criterion, fit, objects, known, role.playing.get(role.actor))
        elif isinstance(criterion, Conduct) and criterion.kind == "moves":
            others = {i for a, i in role.playing.items() if a != role.actor}
            free = [f * (o.id not in others) for f, o in zip(fit, objects, strict=True)]
            fit = _first_to_move(free, known)
    return _answered(fit, role, objects)


def _answered(fit: list[float], role: Role, objects: Sequence[ObjectBelief]) -> list[float]:
    """Apply the operator's answers: an identified object is that actor and no other."""
    answers = role.mind.answers
    if not answers:
        return fit
    actors = task_actors(role.task)
    said = {o.id: answers[o.id] for o in objects if answers.get(o.id) in actors}
    return [
        float(said[o.id] == role.actor) if o.id in said else f
        for o, f in zip(objects, fit, strict=True)
    ]


def strength(belief: ObjectBelief, models: Sequence[str]) -> float:
    """The strength of the belief that an object is one of some models, 0 to 1."""
    total = 0.0
    for candidate in belief.candidates:  # plain loops: called many times per step
        if candidate.name in models:
            total += candidate.share
    return min(1.0, total)


def asks_for_traits(task: Task) -> bool:
    """Whether a task describes any actor by more than its models and its machine."""
    criteria = (c for a in (*task.actors, *task.bystanders) for c in a.criteria)
    return any(not isinstance(c, PartOf | Another | OtherModels) for c in criteria)


def asks_for_colour(task: Task) -> bool:
    """Whether a task describes any actor by its colour."""
    declared = (*task.actors, *task.bystanders)
    return any(isinstance(c, Colours) for a in declared for c in a.criteria)


def _meets(criterion: Criterion, role: Role, belief: ObjectBelief, traits: Traits) -> float:
    """The fitness of an object for one criterion, 0 to 1; orders are evaluated elsewhere."""
    match criterion:
        case Colours(names=names):
            shares = (colour_share(name, traits.palette) for name in names)
            return _ramp(max(shares), *COLOURED)
        case Extent():
            return _sized(criterion, value(role.task.amount(criterion.amount)), traits)
        case Place(at=at):
            return _placed(traits, at, role.mind)
        case Conduct():
            # Conduct identifies an actor once; its later conduct is a matter of stages.
            chosen = role.playing.get(role.actor) == belief.id
            return float(chosen or _behaves(criterion, traits, role.mind))
        case PartOf(machine=machine):
            return _hangs_together(belief.id, role.playing.get(str(machine)), role.mind)
        case Another():
            return NOT_FIRST
        case Ranked() | OtherModels():
            return 1.0
        case _:
            assert_never(criterion)


def _sized(criterion: Extent, bound: float, traits: Traits) -> float:
    if traits.extent != traits.extent:  # NaN: it was never completely visible
        return 0.0
    larger = _ramp(traits.extent, bound * (1 - SIZE_SHARE), bound * (1 + SIZE_SHARE))
    return larger if criterion.compared == "larger" else 1.0 - larger


def _behaves(criterion: Conduct, traits: Traits, mind: Mind) -> bool:
    if criterion.kind == "enters":
        return traits.side == criterion.side if criterion.side else bool(traits.side)
    if criterion.kind == "moves":
        return traits.first_moved is not None
    since = traits.resting_since
    return since is not None and mind.time - since >= REST_S


_ORDERS: Mapping[str, Callable[[Traits], float]] = {
    "largest": lambda t: -t.extent,
    "smallest": lambda t: t.extent,
    "leftmost": lambda t: t.first_centroid[0],
    "rightmost": lambda t: -t.first_centroid[0],
    "highest": lambda t: t.first_centroid[1],
    "lowest": lambda t: -t.first_centroid[1],
}


def _ranked(
    criterion: Ranked,
    fit: Sequence[float],
    objects: Sequence[ObjectBelief],
    known: Sequence[Traits],
    held: int | None,
) -> list[float]:
    """The fitness with an order applied: only the first object keeps it.

    Orders by position use the positions when first seen, since objects move later; objects that appeared much
    later than the present actor are ignored.
    """
    by_size = criterion.rank in ("largest", "smallest")
    until = next((o.first_seen + LATE_S for o in objects if o.id == held and not by_size), None)
    order = _ORDERS[criterion.rank]
    contending = [
        (order(t), o.id)
        for f, o, t in zip(fit, objects, known, strict=True)
        if f >= CONTENDS and (until is None or o.first_seen <= until) and order(t) == order(t)
    ]
    first = min(contending, default=(0.0, None))[1]
    return [f if o.id == first else 0.0 for f, o in zip(fit, objects, strict=True)]


def _first_to_move(fit: Sequence[float], known: Sequence[Traits]) -> list[float]:
    """The fitness of only the first object to move."""
    moved = (
        t.first_moved
        for f, t in zip(fit, known, strict=True)
        if f > 0.0 and t.first_moved is not None
    )
    first = min(moved, default=None)
    return [f if t.first_moved == first else 0.0 for f, t in zip(fit, known, strict=True)]


def _hangs_together(object_id: int, machine: int | None, mind: Mind) -> float:
    """The fitness of an object as a part of its machine; unknown until the machine is found."""
    if machine is None or machine == object_id:
        return 0.0
    measured = kinematics(mind)
    if object_id not in measured.ids or machine not in measured.ids:
        return 0.0
    i, j = measured.ids.index(object_id), measured.ids.index(machine)
    gap = float(measured.gap[i, j])
    return _near(gap, *HANGS, mind) if gap == gap else 0.0


def _placed(traits: Traits, at: tuple[float, float], mind: Mind) -> float:
    """The fitness of an object for a position when first seen; of two there, the nearer centre wins."""
    if traits is NO_TRAITS:
        return 0.0
    dx, dy = traits.first_centroid[0] - at[0], traits.first_centroid[1] - at[1]
    off_centre = math.hypot(dx, dy) / image_diagonal(mind.frame_size)
    return _near(_distance_to_box(traits.first_box, at), *PLACED, mind) * (
        1.0 - min(0.1, off_centre)
    )


def _distance_to_box(box: tuple[int, int, int, int], at: tuple[float, float]) -> float:
    """Distance of a position to a box, pixels; 0 inside."""
    x, y, w, h = box
    dx = max(x - at[0], at[0] - (x + w - 1), 0.0)
    dy = max(y - at[1], at[1] - (y + h - 1), 0.0)
    return math.hypot(dx, dy)


def _near(distance: float, surely: float, at_all: float, mind: Mind) -> float:
    diagonal = image_diagonal(mind.frame_size)
    return 1.0 - _ramp(distance, surely * diagonal, at_all * diagonal)


def _ramp(number: float, low: float, high: float) -> float:
    """0 up to `low`, 1 from `high` on, linear in between."""
    return min(1.0, max(0.0, (number - low) / (high - low))) if high > low else float(number >= low)

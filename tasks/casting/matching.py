"""Casting: weighted matching of actors and objects (paper, section 6).

Each object has several possible identities with strengths. The weight of a pair is the strength of the belief
that the object is one of the actor's models, or its fitness for the actor's criteria (`fitness.py`); the
matching with the greatest total weight is chosen, with at most one actor per object. Machines are matched
before their parts.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence

import numpy as np
from scipy.optimize import linear_sum_assignment

from visup.agent import Binding, Mind, ObjectBelief, Presence
from visup.agent.model.fast_replace import replace
from visup.rules.presence.object_tracks import presence_memory, sides_of
from visup.rules.relations.reasoner import kinematics
from visup.tasks.casting.exclusion import guessed, moves
from visup.tasks.casting.fitness import Role, fits
from visup.tasks.grammar.nodes import Task
from visup.tasks.grammar.structure import machines_of, stage_actors, stage_names, task_actors
from visup.tasks.verification.settings import DEFAULT_SETTINGS, TaskSettings

CURRENT_BONUS = 1.1  # actors of the active stage take precedence when two compete for one object


def models_of(task: Task, actor: str, mind: Mind) -> tuple[str, ...]:
    """The models of an actor: as bound by the user, else as declared, else its own name."""
    said = mind.actors.get(actor) or mind.actors.get(task.actor(actor).spare)
    return tuple(said or ()) or task.models(actor)


def match(
    task: Task,
    mind: Mind,
    before: Sequence[Binding] = (),
    current: Sequence[str] = (),
    settings: TaskSettings = DEFAULT_SETTINGS,
) -> tuple[Binding, ...]:
    """Match the actors of a task to objects.

    Args:
        task: The task.
        mind: The mind; confirmed objects can be actors, seen or hidden. One that has left stays bound until
            another object takes over.
        before: The bindings of the last step; they are kept unless another is clearly better.
        current: Names of actors of the active stage.
        settings: Thresholds.

    Returns:
        One binding for each actor, in the order of the task.
    """
    actors = task_actors(task)
    models = {a: models_of(task, a, mind) for a in actors}
    held = {b.actor: b.object_id for b in before if b.object_id is not None and not b.guessed}
    objects = [b for _, b in sorted(mind.objects.items()) if _eligible(b, held)]
    found: dict[str, tuple[int, float]] = {}
    if objects:
        for group in _machines_first(task, actors):
            free = [o for o in objects if o.id not in {i for i, _ in found.values()}]
            playing = {**held, **{a: i for a, (i, _) in found.items()}}
            pure = [fits(Role(task, a, mind, playing), models[a], free) for a in group]
            weight = [
                _weights(row, free, held.get(a), a in current, settings)
                for row, a in zip(pure, group, strict=True)
            ]
            chosen = best_matching(weight).items()
            found |= {group[i]: (free[j].id, pure[i][j]) for i, j in chosen}
    bindings = [Binding(a, models[a], *found.get(a, (None, 0.0))) for a in actors]
    return guessed(task, mind, bindings, before, settings)


def _machines_first(task: Task, actors: Sequence[str]) -> Iterator[tuple[str, ...]]:
    """Actors in groups that are matched in turn: parts after their machines."""
    depth = {a: len(machines_of(task, a)) for a in actors}
    for least in sorted(set(depth.values())):
        yield tuple(a for a in actors if depth[a] == least)


def best_matching(weight: Sequence[Sequence[float]]) -> dict[int, int]:
    """Row -> column of the matching with the greatest total weight; pairs of weight 0 are left out."""
    wanted = [[j for j, w in enumerate(row) if w > 0.0] for row in weight]
    columns = [j for row in wanted for j in row]
    if len(set(columns)) == len(columns) and all(len(row) <= 1 for row in wanted):
        # The usual case: at most one candidate per row and no conflicts.
        return {i: row[0] for i, row in enumerate(wanted) if row}
    rows, chosen = linear_sum_assignment(np.array(weight), maximize=True)
    found = zip(rows.tolist(), chosen.tolist(), strict=True)
    return {i: j for i, j in found if weight[i][j] > 0.0}


def _weights(
    strengths: Sequence[float],
    objects: Sequence[ObjectBelief],
    held: int | None,
    current: bool,
    settings: TaskSettings,
) -> list[float]:
    """The weight of each object for one actor; 0 if too weak to be bound."""
    bonus = CURRENT_BONUS if current else 1.0
    weight = [s * bonus for s in strengths]
    for j, belief in enumerate(objects):
        if held == belief.id:
            weight[j] = _held_weight(weight[j], belief, settings)
        elif belief.presence is Presence.LEFT:
            weight[j] = 0.0  # an object that has left gets no new actor
    return [w if w >= settings.bind_at else 0.0 for w in weight]


def _eligible(belief: ObjectBelief, held: Mapping[str, int]) -> bool:
    if belief.presence is Presence.LEFT:
        return belief.id in held.values()
    return belief.confirmed


def _held_weight(weight: float, belief: ObjectBelief, settings: TaskSettings) -> float:
    if belief.presence is Presence.LEFT:
        return settings.bind_at
    return weight + settings.keep_bonus


def bystanders(
    task: Task,
    mind: Mind,
    bindings: Sequence[Binding],
    settings: TaskSettings = DEFAULT_SETTINGS,
) -> tuple[int, ...]:
    """Ids of the task's bystanders: objects that play no actor and fit a bystander declaration."""
    if not task.bystanders:
        return ()
    playing = {b.actor: b.object_id for b in bindings if b.object_id is not None}
    others = [o for o in mind.present() if o.id not in playing.values()]
    if any(not b.name for b in task.bystanders):
        return tuple(o.id for o in others)
    rows = [
        fits(Role(task, b.name, mind, {}), task.models(b.name), others) for b in task.bystanders
    ]
    best = [max(row[j] for row in rows) for j in range(len(others))]
    return tuple(o.id for o, fit in zip(others, best, strict=True) if fit >= settings.familiar)


def machines(task: Task, bindings: Sequence[Binding]) -> tuple[tuple[int, ...], ...]:
    """The objects of each machine with its parts, for machines with found parts."""
    playing = {b.actor: b.object_id for b in bindings if b.object_id is not None}
    groups: dict[str, set[int]] = {}
    for actor, object_id in playing.items():
        whole = (*machines_of(task, actor), actor)
        outermost = next((m for m in reversed(whole[:-1])), actor)
        groups.setdefault(outermost, set()).add(object_id)
    return tuple(tuple(sorted(g)) for g in groups.values() if len(g) > 1)


def unexplained(
    mind: Mind,
    bindings: Sequence[Binding],
    settings: TaskSettings = DEFAULT_SETTINGS,
    optional: Collection[str] = (),
    task: Task | None = None,
) -> tuple[int, ...]:
    """Ids of visible objects that no actor explains; `optional` actors are not waited for.

    With all actors bound that is any further object. While an actor is unbound, it may be an unidentified
    object, one that could be any actor, or one identified for only a few seconds; only an object that is
    clearly something else is unexplained. Nor is an unknown one that holds an actor, as parts do not move
    by themselves, and a task need not name whoever handles them.
    """
    bound = {b.object_id for b in bindings if b.object_id is not None}
    held = handlers(mind, bindings, settings)
    bindings = [replace(b, object_id=None) if b.guessed else b for b in bindings]
    if task is not None:
        bound.update(bystanders(task, mind, bindings, settings))
    others = [o for o in mind.present() if o.id not in bound and o.presence is not Presence.HIDDEN]
    others = [o for o in others if o.id not in held]
    if task is not None and task.bystanders:
        # Identification takes a while, and until then it may be one of them.
        others = [o for o in others if mind.time - o.first_seen >= settings.acquainted_s]
    if all(b.object_id is not None for b in bindings if b.actor not in optional):
        return tuple(o.id for o in others)
    known = {m for b in bindings for m in b.models}
    strange = [
        o
        for o in others
        if o.strength >= settings.familiar
        and o.name not in known
        and mind.time - o.first_seen >= settings.acquainted_s
    ]
    if task is None or not strange:
        return tuple(o.id for o in strange)
    playing = {b.actor: b.object_id for b in bindings if b.object_id is not None}
    awaited = [b.actor for b in bindings if b.object_id is None and not b.models]
    rows = [fits(Role(task, a, mind, playing), (), strange) for a in awaited]
    free = [all(row[j] < settings.bind_at for row in rows) for j in range(len(strange))]
    return tuple(o.id for o, is_free in zip(strange, free, strict=True) if is_free)


def familiar_objects(
    mind: Mind, bindings: tuple[Binding, ...], settings: TaskSettings, before: tuple[int, ...] = ()
) -> tuple[int, ...]:
    """Ids of all objects that have ever been scenery or handlers; `before` are those of the last step."""
    known = {*scenery(mind, bindings, settings), *handlers(mind, bindings, settings)}
    return tuple(sorted(known.union(before)))


def handlers(
    mind: Mind, bindings: Sequence[Binding], settings: TaskSettings = DEFAULT_SETTINGS
) -> tuple[int, ...]:
    """Ids of unknown objects that hold an actor, or are held by one: who handles it, or the rest of it."""
    bound = {b.object_id for b in bindings if b.object_id is not None}
    held = {i for c in mind.couplings if bound.intersection(c.objects) for i in c.objects} - bound
    return tuple(sorted(i for i in held if _unknown(mind, i, settings)))


def _unknown(mind: Mind, number: int, settings: TaskSettings) -> bool:
    return number in mind.objects and mind.objects[number].strength < settings.familiar


def scenery(
    mind: Mind, bindings: Sequence[Binding], settings: TaskSettings = DEFAULT_SETTINGS
) -> tuple[int, ...]:
    """Ids of objects without a role that are part of the scene.

    These are unknown objects visible from the start, and those that look like an actor found elsewhere if
    they were there from the start, or were first seen at rest inside the image: equal parts on a table.
    """
    bound = {b.object_id for b in bindings}
    taken = {m for b in bindings if b.object_id is not None for m in b.models}
    found = []
    for o in mind.present():
        equal = o.name in taken
        from_start = o.first_seen <= settings.scenery_s
        if o.id in bound or not (equal or (from_start and o.strength < settings.familiar)):
            continue
        if from_start or _lies_there(o.id, mind):
            found.append(o.id)
    return tuple(found)


def _lies_there(object_id: int, mind: Mind) -> bool:
    """Whether an object is at rest that did not come in over the border of the image."""
    track = presence_memory(mind).tracks.get(object_id)
    if track is None or sides_of(track.first_box, mind.frame_size):
        return False
    speed = kinematics(mind).one("speed", object_id)
    return speed == speed and not moves(object_id, mind)  # NaN is not equal to itself


def match_strength(actors: Sequence[str], bindings: Sequence[Binding]) -> float:
    """How well some actors are matched, 0 to 1: the mean strength, 0 for an unbound one."""
    by_actor = {b.actor: b.strength for b in bindings if b.object_id is not None}
    return sum(by_actor.get(a, 0.0) for a in actors) / len(actors) if actors else 0.0


def rank_stages(task: Task, bindings: Sequence[Binding]) -> tuple[tuple[str, float], ...]:
    """The stages of a task that may be active, best matched first; ties in the order of the task."""
    ranked = [(s, match_strength(stage_actors(task, s), bindings)) for s in stage_names(task)]
    return tuple(sorted(ranked, key=lambda pair: -pair[1]))


def rank_tasks(
    tasks: Sequence[Task], mind: Mind, settings: TaskSettings = DEFAULT_SETTINGS
) -> tuple[tuple[str, float], ...]:
    """The tasks that may be in progress, by their best matched stage; ties as given."""
    ranked = []
    for task in tasks:
        stages = rank_stages(task, match(task, mind, settings=settings))
        ranked.append((task.name, stages[0][1] if stages else 0.0))
    return tuple(sorted(ranked, key=lambda pair: -pair[1]))

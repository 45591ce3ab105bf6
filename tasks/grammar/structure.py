"""The structure of a task: its stages and their actors."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import wraps
from typing import TypeVar

from visup.rules.formula.nodes import SIGNAL_WORDS, Comparison
from visup.tasks.grammar.conditions import Fact, action_of, bounds_of, facts_of, is_periodic
from visup.tasks.grammar.nodes import (
    Action,
    Actor,
    Actors,
    Conditioned,
    Course,
    Reference,
    Stage,
    StageCondition,
    Task,
    walk,
)
from visup.tasks.grammar.units import SIZE, dimension, value

T = TypeVar("T")
MAX_CACHED = 64  # cached tasks per function


def cached_by_identity(read_off: Callable[[Task], T]) -> Callable[[Task], T]:
    """Cache a function of a task by the identity of the task object.

    Supervision calls such functions at each step; comparing whole trees would take as long as traversing
    them.
    """
    known: dict[int, tuple[Task, T]] = {}

    @wraps(read_off)
    def remembered(task: Task) -> T:
        found = known.get(id(task))
        if found is None or found[0] is not task:
            if len(known) >= MAX_CACHED:
                known.clear()
            found = known[id(task)] = (task, read_off(task))
        return found[1]

    return remembered


def tasks_of(file: Task) -> tuple[Task, ...]:
    """The tasks of a file, each with its relevant invariants."""
    found = []
    for name in file.roots:
        root = file.stage(name)
        reached = {s.name for s in _reached(file, root)} if root else set()
        kept = (i for i in file.invariants if not i.during or {r.stage for r in i.during} & reached)
        found.append(replace(file, root=name, invariants=tuple(kept)))
    return tuple(found)


@cached_by_identity
def stage_names(task: Task) -> tuple[str, ...]:
    """The stages that directly require actions, in the order of the task."""
    root = task.stage(task.name)
    reached = _reached(task, root) if root else []
    names = dict.fromkeys(s.name for s in reached if _asks(task, s))
    return tuple(names)


def stages_inside(task: Task, name: str) -> frozenset[str]:
    """The names of all stages reachable from a stage, including itself."""
    stage = task.stage(name)
    return frozenset(s.name for s in _reached(task, stage)) if stage else frozenset()


def stage_actors(task: Task, stage: str) -> tuple[str, ...]:
    """The actors of the actions that one stage directly requires, in the order of the text."""
    rule = task.stage(stage)
    if rule is None or isinstance(rule.body, Actors):
        return ()
    return tuple(dict.fromkeys(a for n in walk(rule.body) for a in _names(task, n)))


@cached_by_identity
def task_actors(task: Task) -> tuple[str, ...]:
    """All actors of a task in the order of its stages; machines of parts last."""
    root = task.stage(task.name)
    grouped = [s.name for s in _reached(task, root)] if root else []
    staged = [a for s in (*stage_names(task), *grouped) for a in stage_actors(task, s)]
    watched = [
        a for i in task.invariants for f in facts_of(i.condition) for a in fact_key(task, f)[1]
    ]
    named = tuple(dict.fromkeys((*staged, *watched)))
    return tuple(dict.fromkeys((*named, *(m for a in named for m in machines_of(task, a)))))


def spare_kinds(task: Task) -> tuple[str, ...]:
    """The actors that are new in each round of a loop, such as `part` of `for each new part`."""
    return tuple(dict.fromkeys(a.spare for a in task.actors if a.spare))


def machines_of(task: Task, actor: str) -> tuple[str, ...]:
    """The machine of which an actor is a part, the machine of that one, and so on."""
    found: dict[str, None] = {}
    machine = task.actor(actor).machine
    while machine is not None and machine not in found and machine != actor:
        found[str(machine)] = None
        machine = task.actor(machine).machine
    return tuple(found)


def undrawn_zones(task: Task) -> tuple[str, ...]:
    """The zones of a task without corners, which must be defined elsewhere."""
    return tuple(z.name for z in task.zones if not z.corners and not z.floor)


def needs_ground(task: Task) -> bool:
    """Whether a task uses floor coordinates: zones or gaps in metres."""
    facts = [f for s in task.stages for f in _facts(s)]
    facts += [f for i in task.invariants for f in facts_of(i.condition)]
    ends = (a for f in facts if isinstance(f, Comparison) for a in bounds_of(f))
    return any(z.floor for z in task.zones) or any(dimension(task.amount(a)) == SIZE for a in ends)


def signals_named(task: Task) -> tuple[str, ...]:
    """The signals of a task, each once."""
    facts = [f for s in task.stages for f in _facts(s)]
    facts += [f for i in task.invariants for f in facts_of(i.condition)]
    asked = (action_of(f) for f in facts if action_of(f).name in SIGNAL_WORDS)
    return tuple(dict.fromkeys(str(a.arguments[0]) for a in asked if a.name != "signal_known"))


def pause_conditions(task: Task) -> Iterator[StageCondition]:
    """All pause conditions of a task, in order with duplicates."""
    for stage in task.stages:
        courses = () if isinstance(stage.body, Actors) else walk(stage.body)
        conditions = (
            c for course in courses if isinstance(course, Conditioned) for c in course.conditions
        )
        yield from (c for c in conditions if c.kind == "pauses")


def _facts(stage: Stage) -> Iterator[Fact]:
    if isinstance(stage.body, Actors):
        return
    for node in walk(stage.body):
        if isinstance(node, Action | Comparison):
            yield node
        elif isinstance(node, Conditioned):
            yield from (f for s in node.conditions for f in facts_of(s.condition))


def declared_sizes(tasks: Iterable[Task], bound: Mapping[str, Iterable[str]]) -> dict[str, float]:
    """The real sizes that some tasks declare, by model.

    Args:
        tasks: Valid tasks; the first takes precedence.
        bound: Actor -> models bound by the user, which take precedence over declarations.

    Returns:
        Model name -> largest extent, metres.
    """
    found: dict[str, float] = {}
    for task in tasks:
        for actor in task.actors:
            if actor.size is not None:
                for model in bound.get(actor.name, task.models(actor.name)):
                    found.setdefault(model, value(task.amount(actor.size)))
    return found


def with_taught_actors(
    tasks: Sequence[Task],
    given: Mapping[str, tuple[str, ...]],
    known: Collection[str],
    taught: Collection[str],
) -> dict[str, tuple[str, ...]]:
    """The given actors, and those bound to a taught model of their name.

    An actor without a declaration is the model of its own name anyway. One declared with missing models
    (`actor station is trex`, written for another scene) is bound to the taught model `station`, if there is
    one. One identified by colour, place or conduct has no models and is left unchanged.

    Args:
        tasks: All tasks of a run.
        given: Actor -> models bound by the user, which take precedence.
        known: Names of all models.
        taught: Names of the taught models.
    """
    actors = dict(given)
    for actor in dict.fromkeys(a for task in tasks for a in task_actors(task)):
        declared = {m for task in tasks if actor in task_actors(task) for m in task.models(actor)}
        unknown = bool(declared) and not declared & set(known)
        if actor not in actors and actor in taught and unknown:
            actors[actor] = (actor,)
    return actors


def fact_key(task: Task, fact: Fact) -> tuple[str, tuple[str, ...]]:
    """The key of a fact of a task, and its actors.

    A plain action is its own key; the key of a comparison includes operator and amount, that of an action on
    a zone the zone, that of a signal its name.
    """
    action, zones = action_of(fact), {z.name for z in task.zones}
    if action.name in SIGNAL_WORDS:
        zones = set(map(str, action.arguments))
    actors = tuple(str(a) for a in action.arguments if a not in zones)
    key = " ".join([action.name, *(a for a in action.arguments if a in zones)])
    if isinstance(fact, Comparison):
        between = " to " if is_periodic(fact) else " and "
        amounts = between.join(str(task.amount(a)) for a in bounds_of(fact))
        key = f"{key} {fact.operator} {amounts}"
    return key, actors


_SIGN = re.compile(r"(?:^|\s)(?=(?:[<>]=?|between|every)\s)")


def key_text(key: str, actors: Iterable[str]) -> str:
    """The source text of a fact by its key (see `fact_key`).

    >>> key_text("inside berth every 5 s", ["car"])
    'inside(car, berth) every 5 s'
    """
    name, _, rest = key.partition(" ")
    sign = _SIGN.search(rest)
    words = rest if sign is None else rest[: sign.start()]
    compared = "" if sign is None else f" {rest[sign.end() :]}"
    return f"{name}({', '.join([*actors, *words.split()])}){compared}"


def period_of(task: Task, periodic: Comparison) -> tuple[float, float]:
    """The shortest and the longest time between two occurrences of a periodic action, seconds."""
    ends = [value(task.amount(a)) for a in bounds_of(periodic)]
    return (ends[0] if len(ends) > 1 else 0.0), ends[-1]


def _names(task: Task, node: Course) -> tuple[str, ...]:
    match node:
        case Action() | Comparison():
            return fact_key(task, node)[1]
        case Conditioned(conditions=signs):
            facts = (f for s in signs for f in facts_of(s.condition))
            return tuple(a for f in facts for a in fact_key(task, f)[1])
        case Reference(stage=name):
            rule = task.stage(name)
            if rule is not None and isinstance(rule.body, Actors):
                return fact_key(task, Action(rule.name, rule.body.names))[1]
    return ()


def _asks(task: Task, stage: Stage) -> bool:
    # Conditions on the progress of a group require nothing; its stages do.
    return not isinstance(stage.body, Actors) and any(
        isinstance(n, Action | Comparison) or (isinstance(n, Reference) and _names(task, n))
        for n in walk(stage.body)
    )


def _reached(task: Task, stage: Stage) -> list[Stage]:
    """A stage and all reachable from it, depth first, each once."""
    known = {s.name: s for s in reversed(task.stages)}
    found: dict[str, Stage] = {}
    todo = [stage]
    while todo:
        stage = todo.pop()
        if stage.name in found:
            continue
        found[stage.name] = stage
        if not isinstance(stage.body, Actors):
            named = [n.stage for n in walk(stage.body) if isinstance(n, Reference)]
            todo += [known[n] for n in reversed(named) if n in known]
    return list(found.values())


def with_bystanders(task: Task, names: Iterable[str]) -> Task:
    """The task with further bystanders.

    Args:
        task: The task.
        names: Names of models or taught objects.
    """
    declared = {a.name for a in (*task.actors, *task.bystanders)}
    more = (Actor(n, (n,), bystander=True) for n in dict.fromkeys(names) if n not in declared)
    return replace(task, bystanders=(*task.bystanders, *more))

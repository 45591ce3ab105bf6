"""Which stages a task has and who acts in them, read off its tree."""

from __future__ import annotations

from visup.tasks.tree import Action, Actors, Course, Reference, Stage, Task, walk


def stage_names(task: Task) -> tuple[str, ...]:
    """The stages that ask for actions themselves, in the order in which the task comes to them."""
    names = dict.fromkeys(s.name for s in _reached(task, task.stages[0]) if _asks(task, s))
    return tuple(names)


def stage_actors(task: Task, stage: str) -> tuple[str, ...]:
    """The actors of the actions that one stage asks for itself, in the order of the text."""
    rule = task.stage(stage)
    if rule is None or isinstance(rule.body, Actors):
        return ()
    return tuple(dict.fromkeys(a for n in walk(rule.body) for a in _names(task, n)))


def task_actors(task: Task) -> tuple[str, ...]:
    """All actors of a task, in the order in which its stages ask for them."""
    staged = [a for s in stage_names(task) for a in stage_actors(task, s)]
    watched = [str(a) for i in task.invariants for a in i.action.actors]
    return tuple(dict.fromkeys((*staged, *watched)))


def _names(task: Task, node: Course) -> tuple[str, ...]:
    match node:
        case Action(actors=actors):
            return tuple(map(str, actors))
        case Reference(stage=name):
            rule = task.stage(name)
            if rule is not None and isinstance(rule.body, Actors):
                return tuple(map(str, rule.body.names))
    return ()


def _asks(task: Task, stage: Stage) -> bool:
    return not isinstance(stage.body, Actors) and any(_names(task, n) for n in walk(stage.body))


def _reached(task: Task, stage: Stage, seen: frozenset[str] = frozenset()) -> list[Stage]:
    """A stage and all that it refers to, depth first."""
    found = [stage]
    if isinstance(stage.body, Actors):
        return found
    for node in walk(stage.body):
        if isinstance(node, Reference):
            rule = task.stage(node.stage)
            if rule is not None and rule.name not in {*seen, *(s.name for s in found), stage.name}:
                found += _reached(task, rule, seen | {s.name for s in found})
    return found

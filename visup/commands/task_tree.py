"""The tree of a task for the terminal."""

from __future__ import annotations

from rich.markup import escape
from rich.tree import Tree

from visup.tasks.tree import (
    Action,
    Actors,
    AnyOrder,
    Choice,
    Comparison,
    Counted,
    Course,
    Judged,
    Reference,
    Repeated,
    Sequence,
    Task,
    Timed,
    Together,
)

REPEATS = {"?": "perhaps", "*": "any number of times", "+": "at least once"}


def task_tree(task: Task) -> Tree:
    """The tree of a task for the terminal: stages with what they ask for, and declarations.

    Args:
        task: A task without mistakes.

    Returns:
        A rich tree; each stage is opened where it is first referred to.
    """
    tree = Tree(f"[bold]{escape(task.name)}[/bold]")
    _grow(tree, task, task.name, set())
    declared = (
        ("actors", task.actors),
        ("zones", task.zones),
        ("parameters", task.parameters),
        ("invariants", task.invariants),
    )
    for title, nodes in declared:
        if nodes:
            branch = tree.add(f"[dim]{title}[/dim]")
            for node in nodes:
                branch.add(escape(str(node)))
    return tree


def _grow(tree: Tree, task: Task, name: str, shown: set[str]) -> None:
    stage = task.stage(name)
    if stage is None or name in shown:
        return
    shown.add(name)
    if stage.text:
        tree.add(f"[italic]{escape(stage.text)}[/italic]")
    if isinstance(stage.body, Actors):
        for actor in stage.body.names:
            tree.add(f"[green]{actor}[/green]")
    else:
        _grow_course(tree, task, stage.body, shown)


TITLES = {Choice: "one of", Together: "at the same time", AnyOrder: "each, in any order"}


def _grow_course(tree: Tree, task: Task, course: Course, shown: set[str]) -> None:
    match course:
        case Action() | Comparison():
            tree.add(f"[cyan]{escape(str(course))}[/cyan]")
        case Reference(stage=name):
            again = " [dim](see above)[/dim]" if name in shown else ""
            _grow(tree.add(f"[bold]<{escape(name)}>[/bold]{again}"), task, name, shown)
        case Sequence(items=items):
            for item in items:
                _grow_course(tree, task, item, shown)
        case Choice(options=parts) | Together(parts=parts) | AnyOrder(items=parts):
            branch = tree.add(f"[dim]{TITLES[type(course)]}[/dim]")
            for part in parts:
                inner = branch.add("[dim]in turn[/dim]") if isinstance(part, Sequence) else branch
                _grow_course(inner, task, part, shown)
        case Timed(item=item, clauses=said) | Judged(item=item, signs=said):
            words = " ".join(map(str, said))
            _grow_course(tree.add(f"[magenta]{escape(words)}[/magenta]"), task, item, shown)
        case Repeated(item=item, mark=mark):
            _grow_course(tree.add(f"[dim]{REPEATS[mark]}[/dim]"), task, item, shown)
        case Counted(item=item):
            _grow_course(tree.add(f"[dim]{course.times}[/dim]"), task, item, shown)

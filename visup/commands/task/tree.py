"""The tree of a task for the terminal."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from rich.markup import escape
from rich.tree import Tree

from visup.tasks.grammar.nodes import Actor, Task
from visup.tasks.tools.outline import Branch, Kind, outline

STYLES: dict[Kind, str] = {
    "task": "bold",
    "stage": "bold",
    "action": "cyan",
    "actor": "green",
    "clause": "magenta",
    "way": "dim",
    "words": "italic",
}


def task_tree(task: Task) -> Tree:
    """The tree of a task for the terminal: stages with what they require, and declarations.

    Args:
        task: A task without mistakes.

    Returns:
        A rich tree; each stage is opened where it is first referred to.
    """
    whole = outline(task)
    tree = Tree(_text(whole))
    _grow(tree, whole)
    declared = (
        ("actors", _told(task.actors)),
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


def _told(actors: Sequence[Actor]) -> tuple[Actor, ...]:
    """Actors with one for all of whom a loop has another one in each round."""
    kinds = (replace(a, name=a.spare) if a.spare else a for a in actors)
    return tuple({a.name: a for a in reversed(tuple(kinds))}.values())[::-1]


def _grow(tree: Tree, branch: Branch) -> None:
    for inner in branch.inside:
        _grow(tree.add(_text(inner)), inner)


def _text(branch: Branch) -> str:
    style = STYLES[branch.kind]
    text = f"<{branch.text}>" if branch.kind == "stage" else branch.text
    again = " [dim](see above)[/dim]" if branch.again else ""
    return f"[{style}]{escape(text)}[/{style}]{again}"

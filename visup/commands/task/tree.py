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
    """The tree of a task for the terminal: stages with their requirements, and declarations.

    Args:
        task: A valid task.

    Returns:
        A rich tree; each stage is expanded at its first reference.
    """
    root = outline(task)
    tree = Tree(_text(root))
    _add_children(tree, root)
    declared = (
        ("actors", _merged_actors(task.actors)),
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


def _merged_actors(actors: Sequence[Actor]) -> tuple[Actor, ...]:
    """The actors, with a single one in place of those that a loop takes one per iteration."""
    kinds = (replace(a, name=a.spare) if a.spare else a for a in actors)
    return tuple({a.name: a for a in reversed(tuple(kinds))}.values())[::-1]


def _add_children(tree: Tree, branch: Branch) -> None:
    for child in branch.inside:
        _add_children(tree.add(_text(child)), child)


def _text(branch: Branch) -> str:
    style = STYLES[branch.kind]
    text = f"<{branch.text}>" if branch.kind == "stage" else branch.text
    again = " [dim](see above)[/dim]" if branch.again else ""
    return f"[{style}]{escape(text)}[/{style}]{again}"

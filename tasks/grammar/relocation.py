"""The tree of an included file, with every place said to be in that file."""

from __future__ import annotations

from dataclasses import replace
from typing import cast

from visup.rules.formula.units import Span
from visup.tasks.grammar.conditions import Name
from visup.tasks.grammar.nodes import Task


def relocated(task: Task, file: str) -> Task:
    """The same tree with every place said to be in an included file."""
    return cast("Task", _moved(task, file))


def _moved(node: object, file: str) -> object:
    if isinstance(node, Span):
        return replace(node, file=file)
    if isinstance(node, Name):
        return Name(node, replace(node.span, file=file))
    if isinstance(node, tuple):
        return tuple(_moved(n, file) for n in node)
    fields = getattr(node, "__dataclass_fields__", None)
    if fields is None:
        return node
    return replace(node, **{f: _moved(getattr(node, f), file) for f in fields})  # type: ignore[type-var]

"""Mistakes in task files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from lark.exceptions import UnexpectedInput

from visup.agent.errors import ManyErrors, Place, TaskError, VisupError
from visup.tasks.actions import Meaning
from visup.tasks.read import read
from visup.tasks.tree import Task


def examine(text: str, file: str, actions: Mapping[str, Meaning]) -> tuple[Task, list[TaskError]]:
    """The tree of a text and all its mistakes."""
    try:
        return read(text, file), []
    except UnexpectedInput as e:
        lines = text.split("\n")
        line = max(1, e.line)
        place = Place(file, line, max(1, e.column), lines[min(line, len(lines)) - 1])
        return Task(()), [TaskError("unexpected text", where=place)]


def raise_all(faults: Sequence[TaskError]) -> None:
    """Raise some mistakes, if there are any."""
    if len(faults) == 1:
        raise faults[0]
    if faults:
        many: list[VisupError] = list(faults)
        raise ManyErrors(many)

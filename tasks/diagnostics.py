"""All mistakes of a task file at once: of its characters, of its syntax, of its meaning."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from visup.agent.errors import ManyErrors, TaskError, VisupError
from visup.tasks.actions import ACTIONS, Meaning
from visup.tasks.check import check
from visup.tasks.faults import Source, TaskFault
from visup.tasks.syntax import clean, parse
from visup.tasks.tree import Task

FOREIGN = ("E121", "E127")  # what is not this language at all need not be spelt well


def examine(
    text: str, file: str = "<text>", actions: Mapping[str, Meaning] = ACTIONS
) -> tuple[Task, list[TaskFault]]:
    """The tree of a text and all its mistakes.

    Args:
        text: A task file.
        file: Its name, for messages.
        actions: The actions that it may ask for.

    Returns:
        What could be read, and the faults in the order of the text; the tree may be used only
        when there are none.
    """
    source = Source(text, file)
    cleaned, odd = clean(text, source)
    parsed = parse(cleaned, source)
    foreign = {f.place.line for f in parsed.faults if f.code in FOREIGN}
    odd = [f for f in odd if f.place.line not in foreign]
    faults = [*odd, *parsed.faults, *check(parsed, source, actions)]
    if not faults and not parsed.task.stages:
        expected = "a rule such as `<dock> ::= converging(arm, satellite)`"
        faults = [TaskFault("E129", "there is no rule", source.place(1, 1), expected=expected)]
    return parsed.task, sorted(faults, key=lambda f: (f.place.line, f.place.column, f.code))


def raise_all(faults: Sequence[TaskError]) -> None:
    """Raise some mistakes, if there are any.

    Raises:
        TaskError: The mistake, when there is one.
        ManyErrors: All of them, when there are several.
    """
    if len(faults) == 1:
        raise faults[0]
    if faults:
        many: list[VisupError] = list(faults)
        raise ManyErrors(many)

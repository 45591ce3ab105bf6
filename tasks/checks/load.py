"""Task files: from text, from a path, or by the name of a task that ships with visup."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from visup.agent.model.errors import TaskError
from visup.rules.language.diagnostics import raise_all
from visup.tasks.actions.actions import ActionDefinition
from visup.tasks.checks.diagnose import diagnose
from visup.tasks.checks.files import read_text, shipped_tasks
from visup.tasks.grammar.nodes import Task
from visup.tasks.grammar.structure import tasks_of

__all__ = ["load_task", "load_tasks", "parse_task", "read_text", "shipped_tasks"]


def parse_task(
    text: str, file: str = "<text>", actions: Mapping[str, ActionDefinition] | None = None
) -> Task:
    """The task that a text describes.

    Args:
        text: A task file.
        file: Its name, for messages; what it includes is looked for beside it.
        actions: The actions that it may ask for; None for all that are known.

    Returns:
        The tree, free of mistakes. Of a file with several tasks it is the whole file, whose `name` is that
        of the first (see `structure.tasks_of`).

    Raises:
        TaskError: When it has one mistake.
        ErrorGroup: When it has several; all are told at once, in the order of the text.
    """
    task, faults = diagnose(text, file, actions)
    raise_all(faults, TaskError)
    return task


def load_task(
    path_or_name: str | Path, actions: Mapping[str, ActionDefinition] | None = None
) -> Task:
    """The task in a file, or the shipped task of that name.

    Args:
        path_or_name: A path, or a name such as `dock`; `file.task:NAME` takes one task of several.
        actions: The actions that it may ask for; None for all that are known.

    Returns:
        The tree, free of mistakes.

    Raises:
        TaskError: When there is no such file or task, it has one mistake, or it holds several tasks.
        ErrorGroup: When it has several mistakes.
    """
    tasks = load_tasks(path_or_name, actions)
    if len(tasks) > 1:
        names = ", ".join(f"`{path_or_name}:{t.name}`" for t in tasks)
        what = f"the file holds {len(tasks)} tasks"
        raise TaskError(what, where=str(path_or_name), expected=f"one of them: {names}")
    return tasks[0]


def load_tasks(
    path_or_name: str | Path, actions: Mapping[str, ActionDefinition] | None = None
) -> tuple[Task, ...]:
    """The tasks in a file, or the shipped task of that name.

    Args:
        path_or_name: See `load_task`.
        actions: The actions that it may ask for; None for all that are known.

    Raises:
        TaskError: When there is no such file or task, or it has one mistake.
        ErrorGroup: When it has several.
    """
    path, wanted = _parted(path_or_name)
    tasks = tasks_of(parse_task(read_text(path), path, actions))
    chosen = tuple(t for t in tasks if not wanted or t.name == wanted)
    if not chosen:
        names = ", ".join(t.name for t in tasks)
        raise TaskError(f"there is no task `{wanted}` in it", where=path, expected=names)
    return chosen


def _parted(path_or_name: str | Path) -> tuple[str, str]:
    """The path, and the name of the task behind the last colon, or empty."""
    path, colon, name = str(path_or_name).rpartition(":")
    if colon and name.isidentifier() and not Path(path_or_name).exists():
        return path, name
    return str(path_or_name), ""

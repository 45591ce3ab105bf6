"""Loads tasks from text, from a path, or by the name of a shipped task."""

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
    """Parse and check a task.

    Args:
        text: A task file.
        file: Its name, for messages; includes are relative to it.
        actions: The available actions; None for all known ones.

    Returns:
        The valid tree; for a file with several tasks the whole file, with the `name` of the first (see
        `structure.tasks_of`).

    Raises:
        TaskError: It has one mistake.
        ErrorGroup: It has several mistakes, in the order of the text.
    """
    task, faults = diagnose(text, file, actions)
    raise_all(faults, TaskError)
    return task


def load_task(
    path_or_name: str | Path, actions: Mapping[str, ActionDefinition] | None = None
) -> Task:
    """The task in a file, or the shipped task of that name.

    Args:
        path_or_name: A path, or a name such as `dock`; `file.task:NAME` selects one of several tasks.
        actions: The available actions; None for all known ones.

    Returns:
        The valid tree.

    Raises:
        TaskError: There is no such file or task, it has one mistake, or it has several tasks.
        ErrorGroup: It has several mistakes.
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
    path, wanted = _split_task_name(path_or_name)
    tasks = tasks_of(parse_task(read_text(path), path, actions))
    chosen = tuple(t for t in tasks if not wanted or t.name == wanted)
    if not chosen:
        names = ", ".join(t.name for t in tasks)
        raise TaskError(f"there is no task `{wanted}` in it", where=path, expected=names)
    return chosen


def _split_task_name(path_or_name: str | Path) -> tuple[str, str]:
    """The path, and the name of the task behind the last colon, or empty."""
    path, colon, name = str(path_or_name).rpartition(":")
    if colon and name.isidentifier() and not Path(path_or_name).exists():
        return path, name
    return str(path_or_name), ""

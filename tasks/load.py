"""Task files: from text, from a path, or by the name of a task that ships with visup."""

from __future__ import annotations

from collections.abc import Mapping
from difflib import get_close_matches
from importlib.resources import files
from pathlib import Path

from visup.agent.errors import TaskError
from visup.tasks.actions import ACTIONS, Meaning
from visup.tasks.diagnostics import examine, raise_all
from visup.tasks.tree import Task


def parse_task(text: str, file: str = "<text>", actions: Mapping[str, Meaning] = ACTIONS) -> Task:
    """The task that a text describes.

    Args:
        text: A task file.
        file: Its name, for messages.
        actions: The actions that it may ask for.

    Returns:
        The tree, free of mistakes.

    Raises:
        TaskError: When it has one mistake.
        ManyErrors: When it has several; all are told at once, in the order of the text.
    """
    task, faults = examine(text, file, actions)
    raise_all(faults)
    return task


def load_task(path_or_name: str | Path, actions: Mapping[str, Meaning] = ACTIONS) -> Task:
    """The task in a file, or the shipped task of that name.

    Args:
        path_or_name: A path, or a name such as `dock`.
        actions: The actions that it may ask for.

    Returns:
        The tree, free of mistakes.

    Raises:
        TaskError: When there is no such file or task, or it has one mistake.
        ManyErrors: When it has several.
    """
    return parse_task(read_text(path_or_name), str(path_or_name), actions)


def read_text(path_or_name: str | Path) -> str:
    """The text of a task file, or of the shipped task of that name.

    Raises:
        TaskError: When there is no such file or task, or it is not text.
    """
    path = Path(path_or_name)
    if str(path_or_name) in shipped_tasks() and not path.exists():
        resource = files("visup.tasks").joinpath(f"{path_or_name}.task")
        return resource.read_text(encoding="utf-8")
    try:
        return path.read_text(encoding="utf-8-sig")
    except FileNotFoundError:
        raise _no_such(str(path_or_name)) from None
    except UnicodeDecodeError as e:
        what = f"it is not text: byte {e.start} is not UTF-8"
        raise TaskError(what, where=str(path), expected="a task file in UTF-8") from e
    except OSError as e:
        what = f"cannot be read: {e.strerror or e}"
        raise TaskError(what, where=str(path), expected="a task file") from e


def shipped_tasks() -> tuple[str, ...]:
    """Names of the tasks that ship with visup, in alphabetical order."""
    entries = files("visup.tasks").iterdir()
    return tuple(sorted(e.name[: -len(".task")] for e in entries if e.name.endswith(".task")))


def _no_such(name: str) -> TaskError:
    shipped = shipped_tasks()
    close = get_close_matches(Path(name).stem, shipped, n=1)
    hint = f"did you mean the shipped task `{close[0]}`?" if close else None
    expected = f"a file, or a shipped task: {', '.join(shipped)}"
    return TaskError("there is no such task file", where=name, expected=expected, hint=hint)

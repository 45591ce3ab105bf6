"""Locates and reads task files: by path, or shipped tasks by name."""

from __future__ import annotations

import os
from importlib.resources import files
from os.path import normpath
from pathlib import Path

from visup.agent.model.did_you_mean import closest
from visup.agent.model.errors import TaskError
from visup.agent.storage.text_file import read_text_file

ROOT_VARIABLE = "VISUP_TASK_ROOT"
"""Environment variable: the folder in which all included files must lie."""


def include_root(file: str) -> Path:
    """The folder in which included files must be: the one given by the user, else that of the first file.

    Args:
        file: The including task file.
    """
    given = os.environ.get(ROOT_VARIABLE)
    return Path(given) if given else Path(file).parent


def read_text(path_or_name: str | Path) -> str:
    """The text of a task file, or of the shipped task of that name.

    Raises:
        TaskError: There is no such file or task, or it is not text.
    """
    path = Path(path_or_name)
    if str(path_or_name) in shipped_tasks() and not path.exists():
        resource = files("visup.tasks.shipped").joinpath(f"{path_or_name}.task")
        return resource.read_text(encoding="utf-8")
    try:
        return read_text_file(path)
    except FileNotFoundError:
        raise _not_found(str(path_or_name)) from None
    except UnicodeDecodeError as e:
        what = f"it is not text: byte {e.start} is not UTF-8"
        raise TaskError(what, where=str(path), expected="a task file in UTF-8") from e
    except (OSError, ValueError) as e:
        reason = getattr(e, "strerror", None) or e
        what = f"cannot be read: {reason}"
        raise TaskError(what, where=str(path), expected="a task file") from e


def read_beside(path: str, including: str, root: Path | None = None) -> tuple[str, str]:
    """An included file: its name for messages, and its text.

    Args:
        path: The path in the `include`, relative to the including file, or the name of a shipped task.
        including: The file that includes it.
        root: The folder in which it must be; None for anywhere.

    Raises:
        TaskError: There is no such file or task, it is not text, or it is outside the folder.
    """
    candidate = Path(
        normpath(Path(including).parent / path)
    )  # normalised, so that a file has one name
    if path in shipped_tasks() and not candidate.exists():
        return path, read_text(path)
    if root is not None and not _is_within(candidate, root):
        raise TaskError(
            "it is outside the folder of the task being read",
            where=str(candidate)[:LONGEST_NAME],
            expected=f"a file in {root} or below",
            hint=f"{ROOT_VARIABLE} may name a folder above both",
        )
    return str(candidate), read_text(candidate)


LONGEST_NAME = 200


def _is_within(path: Path, root: Path) -> bool:
    """Whether a file is inside a folder after resolving links; False for invalid paths."""
    try:
        return path.resolve().is_relative_to(root.resolve())
    except (OSError, ValueError, RuntimeError):
        return False


def shipped_tasks() -> tuple[str, ...]:
    """Names of the tasks that ship with visup, in alphabetical order."""
    entries = files("visup.tasks.shipped").iterdir()
    return tuple(sorted(e.name[: -len(".task")] for e in entries if e.name.endswith(".task")))


def textmate_grammar() -> str:
    """The TextMate grammar of task files, as JSON text."""
    return files("visup.tasks.tools").joinpath("tasks.tmLanguage.json").read_text(encoding="utf-8")


def _not_found(name: str) -> TaskError:
    shipped = shipped_tasks()
    beside = Path(name).parent
    known = (
        [*shipped, *(p.name for p in sorted(beside.glob("*.task")))] if beside.is_dir() else shipped
    )
    near = closest(Path(name).name, known, 0.75) or closest(Path(name).stem, shipped)
    what = "the shipped task" if near in shipped else "the file"
    hint = f"did you mean {what} `{near}`?" if near else None
    expected = f"a file, or a shipped task: {', '.join(shipped)}"
    return TaskError("there is no such task file", where=name, expected=expected, hint=hint)

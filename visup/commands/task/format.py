"""`visup task format`: put task files into the standard layout."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from visup.terminal.console import echo


def format_files(
    files: Annotated[
        list[str], typer.Argument(help="Task files; `-` formats standard input to standard output.")
    ],
    only_check: Annotated[
        bool,
        typer.Option("--check", help="Change nothing; exit code 1 if a file is not formatted."),
    ] = False,
) -> None:
    """Format task files in place; only the layout changes."""
    from visup.tasks.checks.files import read_text

    differ = False
    for file in files:
        text = sys.stdin.read() if file == "-" else read_text(file)
        new = formatted_source(text, "<stdin>" if file == "-" else file)
        differ = differ or new != text
        if file == "-" and not only_check:
            echo(new, nl=False)
        elif new != text and only_check:
            echo(f"{file}: not formatted")
        elif new != text:
            _write(file, new)
            echo(f"{file}: formatted")
    raise typer.Exit(1 if only_check and differ else 0)


def _write(file: str, text: str) -> None:
    from visup.agent.model.errors import OutputError, TaskError

    if not Path(file).is_file():
        raise TaskError("this task ships with visup and cannot be changed", where=file)
    try:
        Path(file).write_text(text, encoding="utf-8")
    except OSError as error:
        raise OutputError(f"cannot be written: {error.strerror or error}", where=file) from error


def formatted_source(text: str, file: str) -> str:
    """The text of a task file in the standard layout.

    Raises:
        TaskError: It cannot be parsed; tabs are accepted.
        ErrorGroup: The same, with several errors.
    """
    from visup.agent.model.errors import TaskError
    from visup.rules.language.diagnostics import Source, raise_all
    from visup.tasks.diagnostics.normalise import normalise
    from visup.tasks.diagnostics.recovery import parse
    from visup.tasks.tools.formatter import formatted

    source = Source(text, file)
    code, normalisation_errors = normalise(text, source)
    raise_all(
        [*(d for d in normalisation_errors if d.code != "E106"), *parse(code, source).faults],
        TaskError,
    )
    return formatted(text)

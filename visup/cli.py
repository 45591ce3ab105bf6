"""The `visup` command. A command is imported when it is called, so that `--help` comes at once."""

from __future__ import annotations

import gc
import os
import sys
from collections.abc import Callable
from functools import cache
from typing import Annotated

import typer
from typer.main import get_command

from visup.agent.memory_limit import check_memory
from visup.agent.model.errors import VisupError
from visup.commands import PURPOSES
from visup.terminal.console import echo, print_error
from visup.terminal.overview import Overview

BAD_INPUT = 2
FAILED = 1
COLLECT_AFTER = 5000
"""New objects after which garbage is collected: with Python's 700 it takes a twentieth of a short run."""

# Small matrices are many here: threads of the linear algebra library cost more than they bring.
# Set before NumPy is imported; whoever set it otherwise is obeyed.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


class Commands(Overview):
    """All commands of `visup`."""

    purposes = PURPOSES


app = typer.Typer(
    name="visup",
    cls=Commands,
    help="The visual supervisor: watches machines work and reports whether the work goes well.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,  # plain help: drawing it with rich would double the time to start
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _version(wanted: bool) -> None:
    if wanted:
        from visup.version import __version__

        echo(f"visup {__version__}")
        raise typer.Exit


@app.callback()
def options(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version.")
    ] = False,
) -> None:
    """The visual supervisor: watches machines work and reports whether the work goes well."""


@cache
def command() -> Callable[[], object]:
    """The command, made once: what is called from Python again is not put together again."""
    return get_command(app)


def main() -> None:
    """Run the command; an error that the user can fix is printed as one message, with exit code 2."""
    if gc.get_threshold()[0] < COLLECT_AFTER:
        gc.set_threshold(COLLECT_AFTER)
    try:
        if not {"-h", "--help", "--version"} & set(sys.argv):
            check_memory()
        command()()
    except VisupError as error:
        print_error(str(error))
        sys.exit(BAD_INPUT)
    except MemoryError as fault:
        hint = "use smaller frames or files; a run that had started can be resumed"
        print_error(str(VisupError(f"out of memory: {fault}".rstrip(": "), hint=hint)))
        sys.exit(FAILED)
    except BrokenPipeError:
        # The reader (such as `head`) went away; nothing more can be said to it.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(0)


if __name__ == "__main__":
    main()

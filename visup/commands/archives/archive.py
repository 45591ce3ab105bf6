"""`visup archive`: lakes of many runs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

Into = Annotated[
    Path, typer.Option("--into", metavar="LAKE", help="The lake; made when it is not there.")
]

app = typer.Typer(no_args_is_help=True)


@app.command("add")
def add(
    runs: Annotated[
        list[Path], typer.Argument(metavar="RUN...", help="Run folders of `visup watch`.")
    ],
    into: Into,
) -> None:
    """Add runs that were watched to a lake; one that is there already is left alone.

    Exit code: 1 when one of them could not be added; the others are.
    """
    from visup.agent.model.errors import VisupError
    from visup.archive.adding import add_run
    from visup.archive.lake import Lake
    from visup.terminal.console import complain, echo

    lake, failed = Lake.create(into), 0
    for run in runs:
        try:
            key, added = add_run(lake, run)
        except VisupError as fault:
            complain(str(fault))
            failed += 1
        else:
            echo(f"{key}  {run}" if added else f"{key}  {run} was there already")
    raise typer.Exit(1 if failed else 0)

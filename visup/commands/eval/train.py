"""`visup train`: makes the files of learned parameters."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

app = typer.Typer(no_args_is_help=True)


@app.callback()
def _group() -> None:
    """Train the learned parts of visup on labelled data."""


@app.command("motion")
def motion(
    folders: Annotated[
        list[Path], typer.Argument(metavar="DIR...", help="Folders with sequences and their masks.")
    ],
    out: Annotated[Path, typer.Option("--out", metavar="FILE", help="File to write.")],
    seed: Annotated[int, typer.Option(help="Random seed.")] = 0,
    limit: Annotated[int, typer.Option(help="Most frames of each sequence.")] = 250,
    cache: Annotated[
        Path, typer.Option(help="Folder in which to cache features of sequences.")
    ] = Path("runs/training"),
) -> None:
    """Learn which superpixels move independently, from sequences with masks.

    The same data and seed give the same bytes. MotionSettings(foreground=FILE) uses the file.
    """
    from visup.agent.model.errors import OutputError
    from visup.evaluation.training.runner import TrainingPlan, train_motion
    from visup.terminal.console import make_console

    if not out.absolute().parent.is_dir():
        raise OutputError("its folder does not exist", where=str(out))
    with make_console(stderr=True).status("training") as status:
        train_motion(
            folders, out, TrainingPlan(cache, seed, limit), lambda text: status.update(text)
        )

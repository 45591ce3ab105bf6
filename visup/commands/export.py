"""`visup export`: the objects of a recorded run for other tools."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

WITH_HIDDEN = ", plus rows for objects that are hidden or not yet confirmed"


def export(
    run: Annotated[Path, typer.Argument(help="Run folder of `visup watch`, or its journal.")],
    form: Annotated[str, typer.Argument(help="mot, coco, fiftyone or csv.", metavar="FORM")],
    out: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="File to write (default: RUN-FORM.txt, .json or .csv)."),
    ] = None,
) -> None:
    """Write the objects of a run, frame by frame, as MOT, COCO, FiftyOne or CSV."""
    from visup.api.exports import export as write
    from visup.terminal.console import echo

    suffix = {"mot": "txt", "coco": "json", "fiftyone": "json"}.get(form, form)
    target = out or Path(f"{run.name}-{form}.{suffix}")
    boxes = f"{write(run, form, target)} boxes of objects in view"
    echo(f"{target}: {boxes}{WITH_HIDDEN if form == 'csv' else ''}")

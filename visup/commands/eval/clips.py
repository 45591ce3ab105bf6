"""`visup eval clips`: the rendered clips and their bars, as a table."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from rich.table import Table

MISSED = 1


def clips(
    names: Annotated[
        list[str] | None, typer.Argument(metavar="[NAME]...", help="Which clips; all if none.")
    ] = None,
    json_file: Annotated[
        Path | None, typer.Option("--json", help="Write the figures to this file too.")
    ] = None,
    cache: Annotated[Path, typer.Option(help="Folder that keeps the rendered clips.")] = Path(
        "runs/clips"
    ),
) -> None:
    """Rendered clips of what footage lacks: pan, shake, zoom, stops, eclipse ...

    Each has a bar. Exit code 1 when a clip misses its bar.
    """
    from rich.console import Console

    from visup.commands.eval.app import told, writable
    from visup.commands.render import needs_renderer
    from visup.evaluation.motion.rendered_clips import evaluate_clips
    from visup.evaluation.record import write_record

    needs_renderer()
    writable(json_file)
    with told("rendering and seeing") as tell:
        figures = evaluate_clips(cache, names or (), progress=tell)
    console, total = Console(), figures["total"]
    console.print(clips_table(figures["items"]))
    console.print(f"{total['passed']} of {total['clips']} clips pass", highlight=False)
    if json_file:
        write_record(json_file, figures, {"clips": names or "all"})
    raise typer.Exit(MISSED if total["passed"] < total["clips"] else 0)


def clips_table(items: Mapping[str, Mapping[str, Any]]) -> Table:
    """A row for each object of each clip.

    Args:
        items: As of `evaluate_clips`.

    Returns:
        The table, whole at 80 columns.
    """
    from rich.table import Table

    table = Table(title="clips", title_justify="left", padding=(0, 0))
    for heading, justify in (("clip", "left"), ("object", "left"), ("J", "right")):
        table.add_column(heading, justify=justify, no_wrap=True)  # type: ignore[arg-type]
    for heading in ("switches", "ghosts"):
        table.add_column(heading, justify="right", no_wrap=True)
    table.add_column("missed")
    for name, item in items.items():
        missed = "; ".join(item["missed"])
        verdict = f"[red]{missed}[/red]" if missed else "[green]pass[/green]"
        rows = list(item.get("objects", {}).items()) or [("", {})]
        for i, (thing, o) in enumerate(rows):
            first = i == 0
            table.add_row(
                name if first else "",
                thing,
                f"{o['J']:.3f}" if o else "",
                str(o["id_switches"]) if o else "",
                f"{item.get('ghost', 0.0):.1%}" if first else "",
                verdict if first else "",
            )
    return table

"""`visup eval views`: recognition of meshes from unseen directions, as a table and as JSON."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from rich.table import Table

_WORST = 6


def views(
    folder: Annotated[Path, typer.Argument(help="Folder of mesh files.")],
    json_file: Annotated[
        Path | None, typer.Option("--json", help="Write the figures to this file too.")
    ] = None,
    views: Annotated[int, typer.Option(min=1, help="Views of each mesh in the database.")] = 32,
    queries: Annotated[int, typer.Option(min=1, help="Silhouettes asked for of each mesh.")] = 12,
    seed: Annotated[int, typer.Option(min=0, help="Of the queries.")] = 0,
    limit: Annotated[int | None, typer.Option(min=1, help="Meshes, for a quick look.")] = None,
) -> None:
    """Views from unseen directions: clean, with contour noise, cut by a border, both."""
    from rich.console import Console

    from visup.commands.eval.app import checked, told
    from visup.evaluation.record import write_record
    from visup.evaluation.shape.view_recognition import evaluate_views

    checked(folder, json_file)
    with told("recognising") as tell:
        figures = evaluate_views(
            folder, views=views, queries=queries, seed=seed, limit=limit, progress=tell
        )
    console = Console()
    console.print(_table(f"views: {folder}", figures["total"]))
    total = figures["total"]
    console.print(
        f"{total['ms_query']:.1f} ms a query, {total['compared']:.1%} of views compared, "
        f"{total['build_views_per_s']:.0f} views built per second"
    )
    console.print(_hardest(figures["items"]), soft_wrap=True)
    if json_file:
        settings = {"views": views, "queries": queries, "seed": seed, "limit": limit}
        write_record(json_file, figures, settings)


def _table(title: str, total: Mapping[str, Any]) -> Table:
    from rich.table import Table

    from visup.evaluation.shape.view_queries import CONDITIONS

    baseline = total["baseline"]
    table = Table(title=title, title_justify="left")
    for heading in ("", "top1", "top5", "angle", *(f"{name} top1" for name in baseline)):
        table.add_column(heading, justify="right" if heading else "left")
    for condition in CONDITIONS:
        row = total[condition]
        angle = "" if row["angle_deg"] is None else f"{row['angle_deg']:.1f}°"
        others = (f"{baseline[name][condition]:.3f}" for name in baseline)
        table.add_row(condition, f"{row['top1']:.3f}", f"{row['top5']:.3f}", angle, *others)
    return table


def _hardest(items: Mapping[str, Any]) -> str:
    """The objects that are named rightly least often, over all conditions."""
    from visup.evaluation.shape.view_queries import CONDITIONS

    shares = {
        name: sum(row[c]["top1"] for c in CONDITIONS) / len(CONDITIONS)
        for name, row in items.items()
    }
    worst = sorted(shares, key=lambda name: shares[name])[:_WORST]
    return "hardest: " + ", ".join(f"{name} {shares[name]:.2f}" for name in worst)

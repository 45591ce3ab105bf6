"""`visup eval scale` and `visup eval robustness`: model databases when they are large, or damaged."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, Any

import typer

Json = Annotated[Path | None, typer.Option("--json", help="Write the figures to this file too.")]
Seed = Annotated[int, typer.Option(min=0, help="Of all that is drawn.")]

SCALE_KEYS = (
    "open_ms",
    "first_ms",
    "ms_query",
    "ms_search",
    "ms_cpu",
    "ms_worst",
    "rss_mb",
    "compared",
    "lost",
)
ROBUSTNESS_KEYS = ("trials", "refused", "answered", "nothing", "failed", "worst_s")


def scale(
    models: Annotated[Path, typer.Argument(help="Folder of meshes (*.ply).")],
    views: Annotated[int, typer.Option(min=1, help="Views of the largest database.")] = 100_000,
    seed: Seed = 0,
    json_file: Json = None,
) -> None:
    """Model databases that grow: opening, answering, memory, and what the index loses."""
    from visup.evaluation.shape.scale import evaluate_scale

    def run(tell: Callable[[str], None]) -> dict[str, Any]:
        return evaluate_scale(models, most=views, seed=seed, progress=tell)

    settings = {"views": views, "seed": seed}
    figures = run_and_show(f"scale: {models}", run, SCALE_KEYS, json_file, settings)
    total = figures["total"]
    typer.echo(
        f"built at {total['build_views_per_s']:.0f} views a second; "
        f"ten times the views take {total['slower']:.2f} times as long"
    )


def robustness(
    files: Annotated[int, typer.Option(min=0, help="How many damaged database files.")] = 2000,
    masks: Annotated[int, typer.Option(min=0, help="How many odd masks.")] = 2000,
    seed: Seed = 0,
    json_file: Json = None,
) -> None:
    """Damaged database files and odd masks: a clear error, an answer or nothing, within a second."""
    from visup.evaluation.shape.robustness import evaluate_robustness

    def run(tell: Callable[[str], None]) -> dict[str, Any]:
        return evaluate_robustness(files=files, masks=masks, seed=seed, progress=tell)

    settings = {"files": files, "masks": masks, "seed": seed}
    figures = run_and_show("robustness", run, ROBUSTNESS_KEYS, json_file, settings)
    for failure in figures["failures"]:
        typer.echo("{kind}, number {number}: {what}, {seconds:.2f} s".format(**failure))
    if figures["failures"]:
        raise typer.Exit(1)


def run_and_show(
    title: str,
    run: Callable[[Callable[[str], None]], dict[str, Any]],
    keys: tuple[str, ...],
    json_file: Path | None,
    settings: Mapping[str, Any],
) -> dict[str, Any]:
    """Run an evaluation with a line of progress, print its figures and write them to a file."""
    from rich.console import Console

    from visup.commands.eval.app import print_table, told, writable
    from visup.evaluation.record import write_record

    writable(json_file)
    with told(title) as tell:
        figures = run(tell)
    print_table(Console(), title, figures, keys)
    if json_file:
        write_record(json_file, figures, settings)
    return figures

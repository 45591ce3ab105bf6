"""`visup eval faults`: behaviours that misbehave, and what comes of them."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

KEYS = ("trials", "ended", "told", "unknown", "thought", "fine", "back", "over_ms")


def faults(
    count: Annotated[int, typer.Option(min=1, help="How many faults are injected.")] = 1000,
    seed: Annotated[int, typer.Option(min=0, help="Of all that is drawn.")] = 0,
    json_file: Annotated[
        Path | None, typer.Option("--json", help="Write the figures to this file too.")
    ] = None,
) -> None:
    """Faults put into behaviours: every run ends, every fault is told, nothing unknown reads fine.

    Exit code: 0 when that is so, else 1.
    """
    from rich.console import Console

    from visup.commands.eval.app import print_table, told, writable
    from visup.evaluation.record import write_record
    from visup.evaluation.runtime.behaviour_faults import evaluate_faults

    writable(json_file)
    with told("injecting") as tell:
        figures = evaluate_faults(count=count, seed=seed, progress=tell)
    print_table(Console(), f"faults: {count} injected into behaviours", figures, KEYS)
    for failure in figures["failures"][:20]:
        typer.echo("number {number}, {fault} in '{kind}': {problem}".format(**failure))
    if json_file:
        write_record(json_file, figures, {"count": count, "seed": seed})
    raise typer.Exit(1 if figures["failures"] else 0)

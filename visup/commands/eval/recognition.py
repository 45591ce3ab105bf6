"""`visup eval recognition`: recognition against its oracle, on large tasks, and by the clock."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def recognition(
    grammars: Annotated[
        int, typer.Option(min=1, help="Small grammars compared with the exact oracle.")
    ] = 2_000,
    tasks: Annotated[int, typer.Option(min=1, help="Tasks of 30 stages that are followed.")] = 20,
    seed: Annotated[int, typer.Option(help="Seed of the first; one more for each.")] = 0,
    json_file: Annotated[Path | None, typer.Option("--json", help="Write the figures too.")] = None,
) -> None:
    """Recognise random tasks: as the exact oracle does, seen badly, and fast."""
    from rich.console import Console
    from rich.table import Table

    from visup.commands.eval.app import told, writable
    from visup.evaluation.reasoning.recognition import evaluate_recognition
    from visup.evaluation.record import write_record

    writable(json_file)
    with told("recognising") as tell:
        figures, held = evaluate_recognition(grammars, tasks, seed, tell)
    table = Table("figure", "value")
    for name, value in figures.items():
        table.add_row(name, f"{value:.3g}" if isinstance(value, float) else str(value))
    console = Console()
    console.print(table)
    for bar, kept in held.items():
        console.print(f"{'held' if kept else 'MISSED'}: {bar}")
    if json_file is not None:
        settings = {"grammars": grammars, "tasks": tasks, "seed": seed}
        write_record(json_file, {"total": figures, "items": {}}, settings)
    if not all(held.values()):
        raise typer.Exit(1)

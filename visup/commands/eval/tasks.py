"""`visup eval tasks`: how task files are read when they are damaged, long, or quite usual."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def tasks(
    count: Annotated[int, typer.Option(min=0, help="How many damaged files are read.")] = 100_000,
    seed: Annotated[int, typer.Option(help="Seed of the first; one more for each file.")] = 0,
    json_file: Annotated[Path | None, typer.Option("--json", help="Write the figures too.")] = None,
) -> None:
    """Damage task files and read them; time long files and a usual one."""
    from rich.console import Console
    from rich.table import Table

    from visup.commands.eval.app import writable
    from visup.evaluation.reasoning.task_files import fuzz, long_files, seconds
    from visup.evaluation.record import write_record
    from visup.tasks.checks.files import read_text

    writable(json_file)
    found = fuzz(count, seed)
    times = {f"long_{name}_s": seconds(text) for name, text in long_files()}
    times["usual_ms"] = 1000 * seconds(read_text("inspect"), 20)
    figures = {
        "files": found.count,
        "tracebacks": len(found.raised),
        "without_place": len(found.placeless),
        "layout_unstable": len(found.unstable),
        "over_1_s": len(found.slow),
        "slowest_s": round(found.slowest_s, 3),
        "read_without_mistake": found.good,
        "codes_given": len(found.codes),
        **{name: round(value, 3) for name, value in times.items()},
    }
    table = Table("figure", "value")
    for name, value in figures.items():
        table.add_row(name, str(value))
    console = Console()
    console.print(table)
    for number, what in found.raised[:10]:
        console.print(f"seed {number}: {what}", markup=False)
    for name, seeds in (("without place", found.placeless), ("unstable", found.unstable)):
        if seeds:
            console.print(f"{name}: seeds {seeds[:10]}")
    if json_file is not None:
        write_record(json_file, {"total": figures, "items": {}}, {"count": count, "seed": seed})
    if found.failures:
        raise typer.Exit(1)

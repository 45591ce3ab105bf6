"""`visup eval reasoning`: what rules and tasks make of percepts of which the truth is known."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from rich.table import Table

KEYS = (
    "identity",
    "event_precision",
    "event_recall",
    "event_f1",
    "false_coupled",
    "false_exit",
    "ece",
    "spin_error",
    "stage",
    "failing_latency_s",
    "alerts_found",
    "alerts_expected",
    "false_alerts",
    "verdicts_right",
    "verdicts",
)
LONG_KEYS = ("frames", "ms", "ms_ten", "rss_mb", "grown", "snapshot_kb")


def reasoning(
    folder: Annotated[Path, typer.Argument(help="A mission, or a folder of missions.")],
    json_file: Annotated[
        Path | None, typer.Option("--json", help="Write the figures to this file too.")
    ] = None,
    seeds: Annotated[int, typer.Option(min=1, help="Runs of each mission.")] = 20,
    first: Annotated[int, typer.Option(min=0, help="The first seed.")] = 0,
    every: Annotated[int, typer.Option(min=1, help="Use every n-th frame.")] = 1,
    jobs: Annotated[int, typer.Option(min=1, help="Processes.")] = 2,
    merge: Annotated[
        bool, typer.Option("--merge", help="Coupled objects are seen as one region.")
    ] = False,
    long: Annotated[
        int, typer.Option(min=0, help="Instead: so many frames of a script, for memory and speed.")
    ] = 0,
) -> None:
    """Reasoning alone, on percepts made from the truth with noise: identity, events, verdicts."""
    from rich.console import Console

    from visup.commands.eval.app import checked, print_table, told
    from visup.evaluation.record import write_record

    checked(folder, json_file)
    with told("reasoning") as tell:
        if long:
            from visup.evaluation.runtime.endurance import evaluate_endurance

            figures = evaluate_endurance(long, progress=tell)
        else:
            from visup.evaluation.reasoning.simulated_missions import evaluate_reasoning
            from visup.evaluation.simulation.percepts import PerceptNoise

            figures = evaluate_reasoning(
                folder,
                seeds=seeds,
                first=first,
                every=every,
                jobs=jobs,
                noise=PerceptNoise(merge_coupled=merge),
                progress=tell,
            )
    console = Console()
    print_table(console, f"reasoning: {folder}", figures, LONG_KEYS if long else KEYS)
    if not long:
        console.print(reliability(figures))
    settings = {"seeds": seeds, "first": first, "every": every, "merge": merge, "long": long}
    if json_file:
        write_record(json_file, figures, settings)


def reliability(figures: Mapping[str, Any]) -> Table:
    """How often identities were right that were believed so strongly."""
    from rich.table import Table

    table = Table("confidence", "right", "object-frames", title="identity: said and so")
    for row in figures["total"]["reliability"]:
        said, right = f"{row['confidence']:.2f}", f"{row['right']:.3f}"
        table.add_row(said, right, f"{row['count']:.0f}")
    return table

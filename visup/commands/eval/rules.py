"""`visup eval rules`: what rules say against an oracle, and what they cost."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import typer

KEYS = (
    "formulas",
    "samples",
    "online",
    "different",
    "us",
    "samples_per_s",
    "times_rtamt",
    "rules",
    "ms",
    "concerns",
    "kept",
    "kb_each",
    "slower",
)


def rules(
    formulas: Annotated[int, typer.Option(min=10, help="How many random formulas.")] = 10_000,
    seed: Annotated[int, typer.Option(min=0, help="Of all that is drawn.")] = 0,
    json_file: Annotated[
        Path | None, typer.Option("--json", help="Write the figures to this file too.")
    ] = None,
) -> None:
    """Rules over time: equal to an oracle and to rtamt, cost of windows, of rules, of snapshots."""
    from visup.commands.eval.databases import run_and_show
    from visup.evaluation.reasoning.rules import evaluate_rules

    def run(tell: Callable[[str], None]) -> dict[str, Any]:
        return evaluate_rules(formulas=formulas, seed=seed, progress=tell)

    settings = {"formulas": formulas, "seed": seed}
    figures = run_and_show("rules", run, KEYS, json_file, settings)
    if not figures["total"]["rtamt"]:
        typer.echo("rtamt is not installed: nothing was compared with it (pip install rtamt)")
    if any(item.get("different") for item in figures["items"].values()):
        raise typer.Exit(1)

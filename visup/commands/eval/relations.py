"""`visup eval relations`: speed, steadiness and rightness of the relations of boxes."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

RELATION_KEYS = ("fps", "fps_cpu", "plain_fps", "ratio", "changes", "seen_s")


def relations(
    draws: Annotated[int, typer.Option(min=1, help="Random pairs for the oracles.")] = 10_000,
    minutes: Annotated[float, typer.Option(min=0.1, help="How long boxes rest.")] = 10.0,
    seed: Annotated[int, typer.Option(min=0, help="Of all that is drawn.")] = 0,
    json_file: Annotated[
        Path | None, typer.Option("--json", help="Write the figures to this file too.")
    ] = None,
) -> None:
    """Relations of boxes: frames per second, changes of what rests, drift, oracles."""
    from rich.console import Console

    from visup.commands.eval.app import print_table, told, writable
    from visup.evaluation.reasoning.relations import evaluate_relations, settings_of_record
    from visup.evaluation.record import write_record

    writable(json_file)
    with told("judging") as tell:
        figures = evaluate_relations(seed=seed, draws=draws, minutes=minutes, progress=tell)
    print_table(Console(), "relations", figures, RELATION_KEYS)
    typer.echo(
        "of {draws} random pairs, RCC-8 is wrong in {rcc8_wrong}, QTC in {qtc_wrong}".format(
            **figures["total"]
        )
    )
    if json_file:
        settings = {"draws": draws, "minutes": minutes, "seed": seed, **settings_of_record()}
        write_record(json_file, figures, settings)

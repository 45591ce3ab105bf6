"""`visup eval resume`, `soak`, `pace`, `stepping`: kills, runs of hours, the time of a step, the way back."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import typer

KEYS = ("kills", "early", "resumed", "equal", "lost", "resume_s")


def resume(
    json_file: Annotated[
        Path | None, typer.Option("--json", help="Write the figures to this file too.")
    ] = None,
    kills: Annotated[int, typer.Option(min=1, help="How many runs are killed.")] = 200,
    seed: Annotated[int, typer.Option(min=0, help="Of the moments.")] = 0,
    demo: Annotated[bool, typer.Option("--demo", help="Kill runs of the shipped clip.")] = False,
) -> None:
    """Kill runs with SIGKILL, resume them, and compare them with an unbroken run."""
    from rich.console import Console

    from visup.commands.eval.app import print_table, told, writable
    from visup.evaluation.record import write_record
    from visup.evaluation.runtime.resume import evaluate_resume
    from visup.runs.demo import demo_settings

    writable(json_file)
    with told("killing") as tell:
        figures = evaluate_resume(
            demo_settings(5) if demo else None,
            kills=kills,
            seed=seed,
            state_every_s=4.0 if demo else 0.4,
            progress=tell,
        )
    console = Console()
    print_table(console, "resume", figures, KEYS)
    for text in figures["failures"]:
        console.print(text, soft_wrap=True)
    if json_file:
        write_record(json_file, figures, {"kills": kills, "seed": seed, "demo": demo})
    raise typer.Exit(int(figures["total"]["equal"] < kills or figures["total"]["lost"] > 0))


def soak(
    json_file: Annotated[
        Path | None, typer.Option("--json", help="Write the figures to this file too.")
    ] = None,
    frames: Annotated[int, typer.Option(help="Length of the run.")] = 200_000,
) -> None:
    """A run of hours of scripted percepts: time of a step and memory at its start and end."""
    from rich.console import Console

    from visup.commands.eval.app import print_table, told, writable
    from visup.evaluation.record import write_record
    from visup.evaluation.runtime.soak import evaluate_soak

    writable(json_file)
    with told("soaking") as tell:
        figures = evaluate_soak(frames, progress=tell)
    console = Console()
    print_table(console, "soak", figures, ("ms", "rss_mb"))
    for name, value in figures["total"].items():
        console.print(f"{name}: {value:.6g}")
    if json_file:
        write_record(json_file, figures, {"frames": frames})


def stepping(
    json_file: Annotated[
        Path | None, typer.Option("--json", help="Write the figures to this file too.")
    ] = None,
    steps: Annotated[int, typer.Option(help="How many are made and kept.")] = 10_000,
    seed: Annotated[int, typer.Option(min=0, help="Of the places to go back from.")] = 0,
) -> None:
    """Going back by 500 steps: its time, the memory that it takes, and whether it leads to the same."""
    from rich.console import Console

    from visup.commands.eval.app import print_table, told, writable
    from visup.evaluation.record import write_record
    from visup.evaluation.runtime.stepping import evaluate_stepping, missed

    writable(json_file)
    with told("stepping") as tell:
        figures = evaluate_stepping(steps, seed=seed, progress=tell)
    console = Console()
    print_table(console, "stepping", figures, ("median_ms", "most_ms"))
    for name, value in figures["total"].items():
        console.print(f"{name}: {value:.6g}")
    for text in missed(figures):
        console.print(text, soft_wrap=True)
    if json_file:
        write_record(json_file, figures, {"steps": steps, "seed": seed})
    raise typer.Exit(int(bool(missed(figures))))


def pace(
    json_file: Annotated[
        Path | None, typer.Option("--json", help="Write the figures to this file too.")
    ] = None,
    steps: Annotated[int, typer.Option(help="Length of each script.")] = 2000,
    kept: Annotated[int, typer.Option(min=100, help="Minds that are kept in a row.")] = 10_000,
) -> None:
    """The time of a step without perception, of replay and observers, and what a kept mind takes."""
    from visup.commands.eval.databases import run_and_show
    from visup.evaluation.runtime.pace import evaluate_pace

    def run(tell: Callable[[str], None]) -> dict[str, Any]:
        return evaluate_pace(steps, kept=kept, progress=tell)

    keys = ("ms", "ms_low", "think_ms", "alerts", "observers", "replay_fps", "mind_kb")
    run_and_show("pace", run, keys, json_file, {"steps": steps, "kept": kept})

"""`visup task simulate`: walk through the sequences a task allows, list them, or sample them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from visup.terminal.console import echo

if TYPE_CHECKING:
    from visup.tasks.grammar.nodes import Task
    from visup.tasks.tools.simulate import Moment, Position, Trace


def simulate(
    file: Annotated[str, typer.Argument(help="A task file, `file.task:NAME`, or a shipped task.")],
    list_count: Annotated[
        int | None, typer.Option("--list", min=1, help="List this many sequences, shortest first.")
    ] = None,
    sample_count: Annotated[
        int | None, typer.Option("--sample", min=1, help="Sample this many sequences at random.")
    ] = None,
    seed: Annotated[int, typer.Option(help="Seed of the sampling.")] = 0,
) -> None:
    """Walk through a task step by step, or list or sample the sequences it allows."""
    from visup.tasks.checks.load import load_task

    task = load_task(file)
    if list_count is not None:
        _list(task, list_count)
    if sample_count is not None:
        _sample(task, sample_count, seed)
    if list_count is None and sample_count is None:
        _walk(task)


def _list(task: Task, count: int) -> None:
    from itertools import islice

    from visup.tasks.tools.simulate import traces

    sequences = traces(task)
    for number, trace in enumerate(islice(sequences, count), 1):
        echo(f"{number}. {_trace_text(trace)}")
    if next(sequences, None) is not None:
        echo("and more")


def _sample(task: Task, count: int, seed: int) -> None:
    from random import Random

    from visup.tasks.tools.simulate import sample

    rng = Random(seed)
    for number in range(1, count + 1):
        trace, ended = sample(task, rng)
        echo(f"{number}. {_trace_text(trace)}{'' if ended else ', and so on'}")


def _walk(task: Task) -> None:
    """Ask at every step how to continue, until the task ends or the user quits."""
    from visup.tasks.tools.simulate import initial_positions, successors

    echo(f"task {task.name}: choose the next step by number; q quits")
    positions = initial_positions(task)
    while True:
        for number, position in enumerate(positions, 1):
            echo(f"  {number}) {_option_text(position)}")
        chosen = _choose(positions)
        if chosen is None:
            return
        if chosen.state is None:
            echo("the task is done")
            return
        echo(f"now: {_moment_text(chosen.moment)}")
        positions = successors(task, chosen)


def _choose(positions: tuple[Position, ...]) -> Position | None:
    while True:
        try:
            answer = input("> ").strip().lower()
        except (EOFError, KeyboardInterrupt):
            echo()
            return None
        if answer in ("q", "quit", "exit"):
            return None
        if answer.isdecimal() and 1 <= int(answer[:9]) <= len(positions):
            return positions[int(answer[:9]) - 1]
        if not answer and len(positions) == 1:
            return positions[0]
        echo(f"  a number from 1 to {len(positions)}, or q")


def _option_text(position: Position) -> str:
    return _moment_text(position.moment) if position.state is not None else "(the task is done)"


def _trace_text(trace: Trace) -> str:
    return ", then ".join(map(_moment_text, trace)) or "(nothing)"


def _moment_text(moment: Moment) -> str:
    return " & ".join(moment)

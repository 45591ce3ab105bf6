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
    listed: Annotated[
        int | None, typer.Option("--list", min=1, help="List this many sequences, shortest first.")
    ] = None,
    drawn: Annotated[
        int | None, typer.Option("--sample", min=1, help="Sample this many sequences at random.")
    ] = None,
    seed: Annotated[int, typer.Option(help="Seed of the sampling.")] = 0,
) -> None:
    """Walk through a task step by step, or list or sample the sequences it allows."""
    from visup.tasks.checks.load import load_task

    task = load_task(file)
    if listed is not None:
        _list(task, listed)
    if drawn is not None:
        _sample(task, drawn, seed)
    if listed is None and drawn is None:
        _walk(task)


def _list(task: Task, count: int) -> None:
    from itertools import islice

    from visup.tasks.tools.simulate import traces

    found = traces(task)
    for number, course in enumerate(islice(found, count), 1):
        echo(f"{number}. {_line(course)}")
    if next(found, None) is not None:
        echo("and more")


def _sample(task: Task, count: int, seed: int) -> None:
    from random import Random

    from visup.tasks.tools.simulate import sample

    rng = Random(seed)
    for number in range(1, count + 1):
        course, ended = sample(task, rng)
        echo(f"{number}. {_line(course)}{'' if ended else ', and so on'}")


def _walk(task: Task) -> None:
    """Ask at every step how to continue, until the task ends or the user quits."""
    from visup.tasks.tools.simulate import initial_positions, successors

    echo(f"task {task.name}: choose the next step by number; q quits")
    places = initial_positions(task)
    while True:
        for number, place in enumerate(places, 1):
            echo(f"  {number}) {_option(place)}")
        chosen = _ask(places)
        if chosen is None:
            return
        if chosen.state is None:
            echo("the task is done")
            return
        echo(f"now: {_sentence(chosen.moment)}")
        places = successors(task, chosen)


def _ask(places: tuple[Position, ...]) -> Position | None:
    while True:
        try:
            answer = input("> ").strip().lower()
        except (EOFError, KeyboardInterrupt):
            echo()
            return None
        if answer in ("q", "quit", "exit"):
            return None
        if answer.isdecimal() and 1 <= int(answer[:9]) <= len(places):
            return places[int(answer[:9]) - 1]
        if not answer and len(places) == 1:
            return places[0]
        echo(f"  a number from 1 to {len(places)}, or q")


def _option(place: Position) -> str:
    return _sentence(place.moment) if place.state is not None else "(the task is done)"


def _line(course: Trace) -> str:
    return ", then ".join(map(_sentence, course)) or "(nothing)"


def _sentence(moment: Moment) -> str:
    return " & ".join(moment)

"""`visup task`: check task files, show their trees, list the tasks that ship with visup."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from rich.tree import Tree

    from visup.agent.errors import VisupError
    from visup.tasks.tree import Course, Task

app = typer.Typer(help="Check, show and list task files.", no_args_is_help=True)

Files = Annotated[list[str], typer.Argument(help="Task files, or names of shipped tasks.")]
AsJson = Annotated[bool, typer.Option("--json", help="Write JSON instead of text.")]


@app.command()
def check(files: Files, as_json: AsJson = False) -> None:
    """Tell every mistake of some task files; exit code 2 when there is any."""
    from visup.agent.errors import ManyErrors, VisupError
    from visup.tasks.load import load_task

    found: dict[str, list[VisupError]] = {}
    for file in files:
        found[file] = []
        try:
            load_task(file)
        except ManyErrors as e:
            found[file] += e.errors
        except VisupError as e:
            found[file].append(e)
    faults = [e for errors in found.values() for e in errors]
    if as_json:
        typer.echo(json.dumps({f: [_as_data(e) for e in es] for f, es in found.items()}, indent=2))
        raise typer.Exit(2 if faults else 0)
    for file, errors in found.items():
        if not errors:
            typer.echo(f"{file}: ok")
    if len(faults) == 1:
        raise faults[0]
    if faults:
        raise ManyErrors(faults)


@app.command()
def show(file: Annotated[str, typer.Argument(help="A task file or shipped task.")]) -> None:
    """Draw the tree of a task."""
    from rich.console import Console

    from visup.tasks.load import load_task

    Console().print(task_tree(load_task(file)))


@app.command("list")
def list_tasks(as_json: AsJson = False) -> None:
    """List the tasks that ship with visup, each with the first line of its file."""
    from visup.tasks.load import read_text, shipped_tasks

    about = {name: _first_comment(read_text(name)) for name in shipped_tasks()}
    if as_json:
        typer.echo(json.dumps(about, indent=2))
        return
    width = max(map(len, about), default=0)
    for name, words in about.items():
        typer.echo(f"{name:{width}}  {words}")


def task_tree(task: Task) -> Tree:
    """The tree of a task for the terminal: stages with what they ask for, actors, invariants.

    Args:
        task: A task without mistakes.

    Returns:
        A rich tree; each stage is opened where it is first referred to.
    """
    from rich.markup import escape
    from rich.tree import Tree

    tree = Tree(f"[bold]{escape(task.name)}[/bold]")
    _grow(tree, task, task.stages[0].name, set())
    for title, nodes in (("actors", task.actors), ("invariants", task.invariants)):
        if nodes:
            branch = tree.add(f"[dim]{title}[/dim]")
            for node in nodes:
                branch.add(escape(str(node)))
    return tree


def _grow(tree: Tree, task: Task, name: str, shown: set[str]) -> None:
    from visup.tasks.tree import Actors

    stage = task.stage(name)
    if stage is None or name in shown:
        return
    shown.add(name)
    if isinstance(stage.body, Actors):
        for actor in stage.body.names:
            tree.add(f"[green]{actor}[/green]")
    else:
        _grow_course(tree, task, stage.body, shown)


def _grow_course(tree: Tree, task: Task, course: Course, shown: set[str]) -> None:
    from rich.markup import escape

    from visup.tasks.tree import Action, Choice, Reference, Repeated, Sequence, Timed, Together

    match course:
        case Action():
            tree.add(f"[cyan]{escape(str(course))}[/cyan]")
        case Reference(stage=name):
            again = " [dim](see above)[/dim]" if name in shown else ""
            _grow(tree.add(f"[bold]<{escape(name)}>[/bold]{again}"), task, name, shown)
        case Sequence(items=items):
            for item in items:
                _grow_course(tree, task, item, shown)
        case Choice(options=parts) | Together(parts=parts):
            title = "one of" if isinstance(course, Choice) else "at the same time"
            branch = tree.add(f"[dim]{title}[/dim]")
            for part in parts:
                inner = branch.add("[dim]in turn[/dim]") if isinstance(part, Sequence) else branch
                _grow_course(inner, task, part, shown)
        case Timed(item=item, clauses=clauses):
            words = " ".join(map(str, clauses))
            _grow_course(tree.add(f"[magenta]{escape(words)}[/magenta]"), task, item, shown)
        case Repeated(item=item, mark=mark):
            _grow_course(tree.add(f"[dim]{REPEATS[mark]}[/dim]"), task, item, shown)


REPEATS = {"?": "perhaps", "*": "any number of times", "+": "at least once"}


def _as_data(error: VisupError) -> dict[str, Any]:
    from visup.agent.errors import Place

    where = error.where
    place: dict[str, Any] = {"file": str(where) if where else None}
    if isinstance(where, Place):
        place = {
            "file": where.file,
            "line": where.line,
            "column": where.column,
            "length": where.length,
        }
    return {
        "code": getattr(error, "code", None),
        "what": error.what,
        **place,
        "expected": error.expected,
        "hint": error.hint,
    }


def _first_comment(text: str) -> str:
    first = text.split("\n", 1)[0].lstrip("# ").strip()
    return first.split(": ", 1)[-1]

"""`visup behaviours`: list installed behaviours, check one, create a new one from a template."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from visup.terminal.console import echo, make_console

if TYPE_CHECKING:
    from rich.console import Console

    from visup.agent import Contract
    from visup.agent.plugins.factory import BehaviourFactory

app = typer.Typer(no_args_is_help=True, help="List, check and create behaviours (plug-ins).")

TEMPLATE = '''\
"""The behaviour `{name}`: say here in one line what it perceives.

Check it:  visup behaviours check {name}.py
Run it:    visup watch CLIP.mp4 --behaviour {name}.py
Set it:    visup watch CLIP.mp4 --behaviour {name}.py --set {name}.contrast=80
"""

from pydantic import BaseModel, Field

from visup.agent import Contract


class {title}:
    """Reports where the brightest spot is, when it stands out."""

    contract = Contract("{name}", gives=("{name}",), cost_ms=50)

    class Settings(BaseModel):
        contrast: float = Field(100, gt=0, description="grey levels above the mean")

    def __init__(self, settings=None):
        self.settings = settings or self.Settings()

    def perceive(self, frame, observation, directives):
        grey = frame.image.mean(axis=2)
        y, x = divmod(int(grey.argmax()), grey.shape[1])
        contrast = float(grey[y, x] - grey.mean())
        if contrast > self.settings.contrast:
            yield self.contract.percept(frame, (x, y), confidence=min(contrast / 255, 1.0))
'''


@app.command("list")
def list_behaviours() -> None:
    """Installed behaviours: what they give, need and cost."""
    from rich.table import Table

    from visup.agent.model.errors import BehaviourError
    from visup.agent.plugins.registry import discover_behaviours

    registry, console = discover_behaviours(), make_console()
    table = Table(padding=(0, 0))
    for heading in ("name", "gives", "needs", "every", "budget", "found in"):
        table.add_column(heading, overflow="fold")
    broken = []
    for name in registry.names():
        try:
            factory = registry.factory(name)
            table.add_row(name, *_row(factory.contract), factory.where)
        except BehaviourError as error:
            broken.append(str(error))
    console.print(table)
    for line in broken:
        console.print(line, style="yellow", markup=False)


@app.command("check")
def check(
    target: Annotated[
        str,
        typer.Argument(
            metavar="FILE",
            help="A Python file, package.module:Class, or the name of an installed behaviour.",
        ),
    ],
    assignments: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="NAME.KEY=VALUE", help="A setting of the behaviour."),
    ] = None,
) -> None:
    """Run a behaviour on a variety of clips and check that it keeps its contract.

    Exit code: 0 if it does, 1 if it does not, 2 if it cannot be loaded.
    """
    from visup.agent.plugins.settings import parse_settings

    console, values = make_console(), parse_settings(assignments or ())
    passed = [_check(console, factory, values) for factory in _factories(target)]
    raise typer.Exit(0 if all(passed) else 1)


@app.command("new")
def new(
    name: Annotated[str, typer.Argument(help="Name of the behaviour, such as lamp.")],
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder for the file.")] = Path(),
) -> None:
    """Create a working behaviour from a template, for you to change."""
    from keyword import iskeyword

    from visup.agent.model.errors import OutputError, SettingsError

    if not name.isidentifier() or iskeyword(name):
        raise SettingsError(
            f"'{name}' is not a valid name for a behaviour",
            expected="a word of letters, digits and underscores, such as lamp",
        )
    path = out / f"{name}.py"
    title = "".join(part.capitalize() for part in name.split("_")) or name
    try:
        with path.open("x", encoding="utf-8") as file:
            file.write(TEMPLATE.format(name=name, title=title))
    except FileExistsError as error:
        raise OutputError("the file already exists", where=str(path)) from error
    except OSError as error:
        raise OutputError(f"cannot be written: {error.strerror}", where=str(path)) from error
    echo(f"{path}: edit it, then run\n  visup behaviours check {path}")


def _factories(target: str) -> list[BehaviourFactory]:
    from visup.agent.plugins.factory import find_factories
    from visup.agent.plugins.registry import discover_behaviours

    registry = discover_behaviours()
    return [registry.factory(target)] if target in registry.names() else find_factories(target)


def _check(
    console: Console, factory: BehaviourFactory, values: dict[str, dict[str, object]]
) -> bool:
    from visup.testing import check_results

    name = factory.contract.name if factory.contract else factory.where
    settings = values.get(name, {})
    factory.make(settings)  # what cannot be made at all is an error, not a finding
    results = check_results(lambda: factory.make(settings))
    console.print(f"{name} ({factory.where})", markup=False, style="bold")
    for result in results:
        mark = "[green]ok[/green]    " if result.passed else "[red]failed[/red]"
        console.print(f"  {mark} ", end="")
        detail = f": {result.detail}" if result.detail else ""
        console.print(f"{result.check}{detail}", markup=False, soft_wrap=True)
    return all(r.passed for r in results)


def _row(contract: Contract | None) -> Iterator[str]:
    if contract is None:
        yield from ("?",) * 4
        return
    yield " ".join(contract.gives)
    yield " ".join(contract.needs) or "-"
    pace = f"{contract.every_s:g} s" if contract.every_s else "frame"
    yield f"{pace}, when called" if contract.awake else pace
    yield f"{contract.cost_ms:g} ms" if contract.cost_ms else "-"

"""The top of a command line: commands grouped by purpose, each imported when it is called."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pkgutil import resolve_name
from types import MappingProxyType
from typing import Any, NamedTuple

import typer
from typer import BadParameter
from typer.core import TyperGroup
from typer.main import get_command


class CommandEntry(NamedTuple):
    """A command or group of commands."""

    summary: str
    """One line for the overview."""
    target: str
    """`module:name` of a function, or of a `typer.Typer`."""
    command_class: str = "typer.core:TyperCommand"
    """`module:name` of the class by which the function's arguments are parsed."""


Purposes = Mapping[str, Mapping[str, CommandEntry]]
"""Purpose -> name of a command -> the command."""


class LazyCommands(Mapping[str, Any]):
    """The commands by name; a command is imported when it is asked for.

    To import and put together all of them takes longer than most commands take.
    """

    def __init__(self, entries: Mapping[str, CommandEntry]) -> None:
        self._entries = entries
        self._imported: dict[str, Any] = {}

    def __getitem__(self, name: str) -> Any:
        entry = self._entries[name]
        if name not in self._imported:
            self._imported[name] = _imported(name, entry)
        return self._imported[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._entries)

    def __len__(self) -> int:
        return len(self._entries)


def _imported(name: str, entry: CommandEntry) -> Any:
    app = typer.Typer(rich_markup_mode=None)
    app.callback()(_group)
    defined = resolve_name(entry.target)
    if isinstance(defined, typer.Typer):
        app.add_typer(defined, name=name)
    else:
        app.command(name, cls=resolve_name(entry.command_class))(defined)
    group: Any = get_command(app)
    return group.commands[name]


def _group() -> None:
    """With a function of its own, an app of one command remains a group."""


class Overview(TyperGroup):
    """The top of a command line; its help shows commands by their purpose, one line each."""

    purposes: Purposes = MappingProxyType({})

    def __init__(self, **attributes: Any) -> None:
        entries = {k: entry for group in self.purposes.values() for k, entry in group.items()}
        super().__init__(**{**attributes, "commands": LazyCommands(entries)})

    def list_commands(self, ctx: Any) -> list[str]:
        """The names, for which nothing need be imported."""
        return list(self.commands)

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write the commands."""
        for purpose, commands in self.purposes.items():
            with formatter.section(purpose):
                formatter.write_dl([(name, entry.summary) for name, entry in commands.items()])

    def make_context(self, *arguments: Any, **options: Any) -> Any:
        """As usual, but error messages about bad arguments are made printable."""
        with _printable_errors():
            return super().make_context(*arguments, **options)

    def invoke(self, ctx: Any) -> Any:
        """As usual, but error messages about bad arguments are made printable."""
        with _printable_errors():
            return super().invoke(ctx)


@contextmanager
def _printable_errors() -> Iterator[None]:
    """Typer prints its own error messages, which quote names and values that may be untrusted."""
    try:
        yield
    except Exception as error:
        if isinstance(error, _USAGE_ERROR):
            from visup.wording import printable

            error.message = printable(error.message)
        raise


_USAGE_ERROR: Any = BadParameter.__mro__[2]
"""Base class of typer's usage errors: click's in older versions, its own in newer ones."""

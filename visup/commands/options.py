"""Options of commands, made from the settings records that they fill.

`takes(WatchSettings)` gives a command one option for each setting that is described by an `Option`, and
hands it those that the user gave, by the names of the record's fields: `WatchSettings(source, **given)`.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import MISSING, dataclass, fields
from functools import wraps
from inspect import Parameter, Signature, signature
from pathlib import Path
from typing import Annotated, Any, get_args, get_origin, get_type_hints

import typer

from visup.runs.settings import Option

Given = dict[str, Any]
"""Settings given by the user, by field name."""

SettingsFile = Annotated[
    Path | None,
    typer.Option(
        "--settings",
        metavar="TOML",
        help="Settings file, with tables [behaviours.NAME] and [identity].",
    ),
]

REPLAYED = ("tasks", "rules", "early", "at_end", "actors", "zones")
"""The settings that a replay of a recorded run may change."""


@dataclass(frozen=True, slots=True)
class Setting:
    """A field of a settings record that has an option.

    Attributes:
        name: Name of the field.
        kind: Its type.
        default: Its value if the option is not given.
        option: Its option.
    """

    name: str
    kind: Any
    default: Any
    option: Option

    @property
    def flag(self) -> str:
        """The option as typed."""
        return self.option.flag or f"--{self.name.replace('_', '-')}"

    @property
    def repeated(self) -> bool:
        """Whether the option may be given several times."""
        return get_origin(self.kind) in (tuple, Mapping)

    def parameter(self) -> Parameter:
        """The parameter from which typer makes an option."""
        kind, default = self.kind, self.default
        if self.repeated:
            kind = list[Path] | None if Path in get_args(kind) else list[str] | None
            default = None
        flags = (self.option.flag,) if self.option.flag else ()
        number = next((k for k in (int, float) if k in (kind, *get_args(kind))), None)
        option = typer.Option(
            *flags,
            metavar=self.option.metavar or (number and _METAVARS[number]),
            help=self.option.help,
            parser=number and number_parser(number, self.option.at_least),
            autocompletion=self.option.complete,
        )
        annotation = Annotated[kind, option]  # type: ignore[valid-type]
        return Parameter(self.name, Parameter.KEYWORD_ONLY, default=default, annotation=annotation)

    def read(self, value: Any) -> Any:
        """The setting from the given value; None or the default if none was given."""
        if not self.repeated:
            return value
        return self.option.parse(value) if self.option.parse and value else tuple(value or ())


_METAVARS = {int: "N", float: "NUMBER"}


def number_parser(kind: type[int] | type[float], at_least: float | None) -> Callable[[Any], Any]:
    """A parser of typed numbers, with readable messages for invalid ones.

    Args:
        kind: `int` or `float`.
        at_least: The smallest value, or None.
    """
    wanted = "a whole number" if kind is int else "a number"
    expected = wanted if at_least is None else f"{wanted}, {at_least:g} or more"

    def read(text: Any) -> Any:
        try:
            value = kind(text)
        except ValueError:
            more = "" if expected == wanted else f"; expected {expected}"
            raise typer.BadParameter(f"'{text}' is not {wanted}{more}") from None
        if at_least is not None and not value >= at_least:
            raise typer.BadParameter(f"{text} is too small; expected {expected}")
        return value

    return read


def settings_of(record: type) -> Iterator[Setting]:
    """The settings of a record that have an option, in order."""
    hints = get_type_hints(record, include_extras=True)
    for each in fields(record):
        kind, *notes = get_args(hints[each.name]) if _annotated(hints[each.name]) else (None,)
        default = None if each.default is MISSING else each.default
        yield from (Setting(each.name, kind, default, n) for n in notes if isinstance(n, Option))


def flags_of(record: type, names: Collection[str]) -> list[str]:
    """The options of some settings, as typed."""
    return [s.flag for s in settings_of(record) if s.name in names]


def takes(
    *records: type, only: Collection[str] = (), **defaults: Any
) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Decorate a command with options for the settings of some records.

    Args:
        records: The command receives the settings given for each, as its first arguments.
        only: Names of the fields that it takes; empty for all.
        defaults: Default values of fields, where they differ from the record's.
    """
    taken = [[s for s in settings_of(record) if not only or s.name in only] for record in records]

    def decorate(command: Callable[..., None]) -> Callable[..., None]:
        own = list(signature(command, eval_str=True).parameters.values())[len(records) :]

        @wraps(command)
        def run(**values: Any) -> None:
            given = [_given(settings, values) for settings in taken]
            command(*given, **values)

        parameters = [s.parameter() for settings in taken for s in settings]
        run.__signature__ = Signature(  # type: ignore[attr-defined]
            [
                *(p.replace(default=defaults.get(p.name, p.default)) for p in parameters),
                *(p.replace(kind=Parameter.KEYWORD_ONLY) for p in own),
            ]
        )
        return run

    return decorate


def _given(settings: list[Setting], values: dict[str, Any]) -> Given:
    """The values of some settings that differ from their defaults."""
    read = {s.name: s.read(values.pop(s.name)) for s in settings}
    return {s.name: read[s.name] for s in settings if read[s.name] not in (s.default, ())}


def _annotated(hint: Any) -> bool:
    return get_origin(hint) is Annotated

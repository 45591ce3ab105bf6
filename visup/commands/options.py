"""Options of commands, made from the settings records that they fill.

`takes(WatchSettings)` gives a command one option for each setting that is described by an `Option`, and
passes it the values that the user gave, by the names of the record's fields:
`WatchSettings(source, **values)`.
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

OptionValues = dict[str, Any]
"""Values of the options that the user gave, by the name of the field."""

SettingsFile = Annotated[
    Path | None,
    typer.Option(
        "--settings",
        metavar="TOML",
        help="Settings file, with tables [behaviours.NAME] and [identity].",
    ),
]

REPLAY_SETTINGS = ("tasks", "rules", "early", "at_end", "actors", "zones")
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
        """The setting, from the value of its option; None or the default without one."""
        if not self.repeated:
            return value
        return self.option.parse(value) if self.option.parse and value else tuple(value or ())


_METAVARS = {int: "N", float: "NUMBER"}


def number_parser(kind: type[int] | type[float], at_least: float | None) -> Callable[[Any], Any]:
    """A parser of numbers on the command line, with readable messages for invalid ones.

    Args:
        kind: `int` or `float`.
        at_least: The smallest value, or None.
    """
    description = "a whole number" if kind is int else "a number"
    expected = description if at_least is None else f"{description}, {at_least:g} or more"

    def read(text: Any) -> Any:
        try:
            value = kind(text)
        except ValueError:
            suffix = "" if expected == description else f"; expected {expected}"
            raise typer.BadParameter(f"'{text}' is not {description}{suffix}") from None
        if at_least is not None and not value >= at_least:
            raise typer.BadParameter(f"{text} is too small; expected {expected}")
        return value

    return read


def settings_of(record: type) -> Iterator[Setting]:
    """The settings of a record that have an option, in order."""
    hints = get_type_hints(record, include_extras=True)
    for f in fields(record):
        hint = hints[f.name]
        kind, *metadata = get_args(hint) if _annotated(hint) else (None,)
        default = None if f.default is MISSING else f.default
        yield from (Setting(f.name, kind, default, m) for m in metadata if isinstance(m, Option))


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
    by_record = [
        [s for s in settings_of(record) if not only or s.name in only] for record in records
    ]

    def decorate(command: Callable[..., None]) -> Callable[..., None]:
        own_parameters = list(signature(command, eval_str=True).parameters.values())[len(records) :]

        @wraps(command)
        def run(**values: Any) -> None:
            values_by_record = [_changed_values(settings, values) for settings in by_record]
            command(*values_by_record, **values)

        parameters = [s.parameter() for settings in by_record for s in settings]
        run.__signature__ = Signature(  # type: ignore[attr-defined]
            [
                *(p.replace(default=defaults.get(p.name, p.default)) for p in parameters),
                *(p.replace(kind=Parameter.KEYWORD_ONLY) for p in own_parameters),
            ]
        )
        return run

    return decorate


def _changed_values(settings: list[Setting], values: dict[str, Any]) -> OptionValues:
    """The values of some settings that differ from their defaults."""
    read = {s.name: s.read(values.pop(s.name)) for s in settings}
    return {s.name: read[s.name] for s in settings if read[s.name] not in (s.default, ())}


def _annotated(hint: Any) -> bool:
    return get_origin(hint) is Annotated

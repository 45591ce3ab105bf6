"""Settings of plug-ins, validated by the plug-in's pydantic model `Settings`."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from visup.agent.model.did_you_mean import did_you_mean
from visup.agent.model.errors import ErrorGroup, SettingsError, VisupError
from visup.agent.storage.text_file import read_text_file

Values = dict[str, dict[str, Any]]
"""Name of a behaviour -> its settings."""


def validate_settings(model: type | None, values: Mapping[str, Any], name: str) -> object:
    """Validate the settings of one behaviour.

    Args:
        model: The pydantic model; None for a behaviour without settings.
        values: The given values.
        name: Name of the behaviour.

    Returns:
        An instance of the model, or None without one.

    Raises:
        SettingsError: A setting is unknown or not valid.
    """
    if model is None:
        if values:
            raise SettingsError(
                f"behaviour '{name}' has no settings",
                where=f"{name}.{next(iter(values))}",
                hint="a behaviour's settings are a pydantic model in it, called Settings",
            )
        return None
    from pydantic import BaseModel, ValidationError

    if not issubclass(model, BaseModel):
        raise SettingsError(
            f"the settings of behaviour '{name}' are a {model.__name__}",
            expected="class Settings(pydantic.BaseModel)",
        )
    unknown = [_unknown(key, model.model_fields, name) for key in values if not _has(model, key)]
    _raise_all(unknown)
    try:
        return model.model_validate(dict(values))
    except ValidationError as faults:
        _raise_all([_settings_error(dict(e), name) for e in faults.errors()])
        raise


def parse_settings(given: Iterable[str]) -> Values:
    """Settings from `NAME.KEY=VALUE`; values are read as TOML, or else as plain text.

    >>> parse_settings(["lamp.contrast=120", "lamp.colour=red"])
    {'lamp': {'contrast': 120, 'colour': 'red'}}

    Raises:
        SettingsError: One is malformed or duplicate.
    """
    values: Values = {}
    for text in given:
        path, equals, value = text.partition("=")
        name, dot, key = path.strip().partition(".")
        if not (equals and dot and name and key):
            raise SettingsError(
                f"--set {text!r} cannot be read",
                expected="NAME.KEY=VALUE, such as lamp.contrast=120",
            )
        if key in values.setdefault(name, {}):
            raise SettingsError(f"--set {path.strip()} comes twice", expected="each setting once")
        values[name][key] = _value(value.strip())
    return values


def read_settings(path: Path) -> Values:
    """Settings from a TOML file: a table `[behaviours.NAME]` for each behaviour.

    Raises:
        SettingsError: The file is missing, is not TOML, or has other content.
    """
    return behaviour_tables(read_toml(path), path)


def read_toml(path: Path) -> dict[str, Any]:
    """Parse a TOML file.

    Raises:
        SettingsError: The file is missing, or is not TOML.
    """
    try:
        return tomllib.loads(read_text_file(path))
    except OSError as fault:
        raise SettingsError(f"cannot be read: {fault.strerror}", where=str(path)) from fault
    except (ValueError, RecursionError) as fault:
        raise SettingsError(f"it is not TOML: {fault}", where=str(path)) from fault


def behaviour_tables(document: Mapping[str, Any], path: Path) -> Values:
    """The tables `[behaviours.NAME]` of a settings file.

    Args:
        document: The file, without its other known tables.
        path: Path of the file.

    Raises:
        SettingsError: It has other content.
    """
    tables = document.get("behaviours", {})
    unexpected = next((key for key in document if key != "behaviours"), None)
    if unexpected is not None:
        raise SettingsError(
            f"'{unexpected}' is unknown", where=str(path), expected="tables [behaviours.NAME]"
        )
    if not isinstance(tables, dict) or not all(isinstance(t, dict) for t in tables.values()):
        raise SettingsError(
            "`behaviours` is not a table of tables",
            where=str(path),
            expected="[behaviours.NAME] with KEY = VALUE below it",
        )
    return tables


def merge_settings(*layers: Mapping[str, Mapping[str, Any]]) -> Values:
    """Merge layers of settings key by key; later layers take precedence."""
    names = dict.fromkeys(name for layer in layers for name in layer)
    return {n: {k: v for layer in layers for k, v in layer.get(n, {}).items()} for n in names}


def _value(text: str) -> Any:
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except (ValueError, RecursionError):
        return text


def _has(model: Any, key: str) -> bool:
    return key in model.model_fields or any(f.alias == key for f in model.model_fields.values())


def _unknown(key: str, known: Mapping[str, object], name: str) -> VisupError:
    return SettingsError(
        f"behaviour '{name}' has no setting '{key}'",
        where=f"{name}.{key}",
        expected=f"one of: {', '.join(known)}" if known else "none",
        hint=did_you_mean(key, known),
    )


def _settings_error(fault: Mapping[str, Any], name: str) -> VisupError:
    place = ".".join(str(part) for part in (name, *fault["loc"]))
    expected = fault["msg"].removeprefix("Value error, ").removeprefix("Input should be ")
    if fault["type"] == "missing":
        return SettingsError("a setting is missing", where=place, hint=f"--set {place}=VALUE")
    return SettingsError(f"{fault['input']!r} is not valid", where=place, expected=expected)


def _raise_all(faults: list[VisupError]) -> None:
    if len(faults) == 1:
        raise faults[0]
    if faults:
        raise ErrorGroup(faults)

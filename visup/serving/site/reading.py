"""Reads the site file (TOML) and reports mistakes by line, in the terms of the file."""

from __future__ import annotations

import json
import os
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, get_args

from pydantic import BaseModel, ValidationError

from visup.agent.model.did_you_mean import did_you_mean
from visup.agent.model.errors import ErrorGroup, SettingsError, SourceLocation, VisupError
from visup.agent.storage.text_file import read_text_file
from visup.serving.site.camera_settings import camera_of
from visup.serving.site.console_settings import address_of, console_of
from visup.serving.site.form import MAX_CAMERAS, CameraTable, RetentionTable, SiteTable
from visup.serving.site.records import RetentionLimits, Site
from visup.serving.site.toml_lines import locate, syntax_location

MAX_VALUE_LENGTH = 80


def read_site(path: Path, environment: Mapping[str, str] | None = None) -> Site:
    """Read a site file.

    Args:
        path: The file.
        environment: Values of placeholders; by default this process's environment.

    Raises:
        SettingsError: The file cannot be read or is not valid; several mistakes form a group
            (`ErrorGroup`), each with its line.
    """
    text = _text(path)
    table = _table(text, path)
    variables = os.environ if environment is None else environment
    faults: list[VisupError] = []
    cameras = []
    for number, camera in enumerate(table.camera):
        try:
            cameras.append(camera_of(table, camera, path.resolve().parent, variables))
        except VisupError as fault:
            where = locate(text, ("camera", number), str(path))
            faults.append(
                SettingsError(fault.what, where=where, expected=fault.expected, hint=fault.hint)
            )
    console = None
    try:
        console = console_of(table.console, path.resolve().parent, variables)
    except VisupError as fault:
        where = locate(text, ("console",), str(path))
        faults.append(SettingsError(fault.what, where=where, expected=fault.expected))
    _raise_if_any([*faults, *_count_faults(table, path), *_duplicate_names(table, text, path)])
    return Site(
        path,
        path.resolve().parent / Path(table.store).expanduser(),
        tuple(cameras),
        _retention(table.retention),
        address_of(table.monitoring.listen),
        table.limits.spare,
        console,
    )


def _retention(table: RetentionTable) -> RetentionLimits:
    store = None if table.store_gb is None else table.store_gb * 1e9
    return RetentionLimits(table.days, table.evidence_days, store, table.free_gb * 1e9)


def _text(path: Path) -> str:
    try:
        return read_text_file(path)
    except OSError as fault:
        raise SettingsError(
            f"the site file cannot be read: {fault.strerror}",
            where=str(path),
            hint="see docs/serving.md for one to begin with",
        ) from fault
    except UnicodeDecodeError as fault:
        raise SettingsError("the file is not text", where=str(path), expected="TOML") from fault


def _table(text: str, path: Path) -> SiteTable:
    try:
        document = tomllib.loads(text)
    except (ValueError, RecursionError) as fault:
        message = str(fault)
        raise SettingsError(
            f"this is not TOML: {message.partition(' (at ')[0]}",
            where=syntax_location(text, message, str(path)),
        ) from fault
    try:
        # TOML lists become tuples, which strict pydantic accepts from JSON only.
        return SiteTable.model_validate_json(json.dumps(document, default=str))
    except ValidationError as faults:
        _raise_if_any(_messages([dict(e) for e in faults.errors()], text, path))
        raise


def _messages(faults: Sequence[Mapping[str, Any]], text: str, path: Path) -> list[VisupError]:
    """Mistakes in the terms of the file, in the order of their lines."""
    by_location: dict[tuple[str | int, ...], list[Mapping[str, Any]]] = {}
    for fault in faults:
        loc = tuple(part for part in fault["loc"] if part not in _ALTERNATIVES)
        by_location.setdefault(loc, []).append(fault)
    located = [(locate(text, loc, str(path)), loc, shown) for loc, shown in by_location.items()]
    located.sort(key=lambda each: (each[0].line, each[0].column))
    return [_mistake(where, loc, shown) for where, loc, shown in located]


def _mistake(
    where: SourceLocation, loc: tuple[str | int, ...], faults: Sequence[Mapping[str, Any]]
) -> VisupError:
    """One mistake; pydantic reports one fault for each alternative of a union type."""
    kind, (*table, key) = faults[0]["type"], loc or ("",)
    if kind == "extra_forbidden":
        known = _keys(table)
        return SettingsError(
            f"'{key}' is not known here",
            where=where,
            expected=f"one of: {', '.join(known)}",
            hint=did_you_mean(str(key), known),
        )
    if kind == "missing":
        return SettingsError(
            f"'{key}' is missing", where=where, expected=_CAMERA if key == "camera" else None
        )
    name = ".".join(str(part) for part in loc if not isinstance(part, int))
    expected = " or ".join(dict.fromkeys(map(_expected, faults)))
    value = _quoted(faults[0]["input"])
    return SettingsError(f"{name} cannot be {value}", where=where, expected=expected)


_CAMERA = '[[camera]], name = "cell", source = "rtsp://..."'
_ALTERNATIVES = ("str", "tuple[str, ...]")
"""Union alternatives that pydantic adds to the location of an error; they are not in the file."""


def _expected(fault: Mapping[str, Any]) -> str:
    if fault["type"] == "string_pattern_mismatch":
        return _PATTERNS[str(fault["loc"][-1])]
    message = str(fault["msg"]).removeprefix("Value error, ").removeprefix("Input should be ")
    return _PLAIN_TYPES.get(message, message.replace("a valid ", "a "))


_PATTERNS = {
    "name": "letters, digits, dot, hyphen and _, the first a letter or digit, at most 63",
    "listen": "ADDRESS:PORT such as 127.0.0.1:9464, or nothing",
    "link": "an http or https address",
}
_PLAIN_TYPES = {
    "a valid string": "a text",
    "a valid array": "a list of texts",
    "a valid boolean": "true or false",
    "an object": "a table",
}


def _quoted(value: object) -> str:
    text = repr(value)
    return text if len(text) <= MAX_VALUE_LENGTH else f"{text[:MAX_VALUE_LENGTH]}..."


def _keys(table: Sequence[str | int]) -> tuple[str, ...]:
    if not table:
        return tuple(SiteTable.model_fields)
    if table[0] == "camera":
        return tuple(CameraTable.model_fields)
    kind = SiteTable.model_fields[str(table[0])].annotation
    kinds = [k for k in (kind, *get_args(kind)) if isinstance(k, type) and issubclass(k, BaseModel)]
    return tuple(kinds[0].model_fields if kinds else SiteTable.model_fields)


def _count_faults(table: SiteTable, path: Path) -> Iterator[VisupError]:
    if not 1 <= len(table.camera) <= MAX_CAMERAS:
        yield SettingsError(
            f"there are {len(table.camera)} cameras in it",
            where=str(path),
            expected=f"1 to {MAX_CAMERAS} tables, such as {_CAMERA}",
        )


def _duplicate_names(table: SiteTable, text: str, path: Path) -> Iterator[VisupError]:
    """Duplicate names: such cameras would share a folder. File systems may ignore case."""
    seen: set[str] = set()
    for number, camera in enumerate(table.camera):
        if camera.name.casefold() in seen:
            yield SettingsError(
                f"two cameras are called '{camera.name}'",
                where=locate(text, ("camera", number, "name"), str(path)),
                expected="a name of its own for each camera",
            )
        seen.add(camera.name.casefold())


def _raise_if_any(faults: list[VisupError]) -> None:
    if len(faults) == 1:
        raise faults[0]
    if faults:
        raise ErrorGroup(faults)

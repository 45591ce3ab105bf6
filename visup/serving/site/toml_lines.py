"""Finds the line of a value in a TOML file, for messages: `tomllib` does not report positions."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Sequence

from visup.agent.model.errors import SourceLocation

KeyPath = tuple[str | int, ...]
"""Such as `("camera", 1, "source")`: the key `source` of the second `[[camera]]`."""

_ARRAY_TABLE = re.compile(r"\s*\[\[\s*([\w.-]+)\s*\]\]")
_TABLE = re.compile(r"\s*\[\s*([\w.-]+)\s*\]")
_KEY = re.compile(r"\s*(?:([\w-]+)|\"([^\"]*)\"|'([^']*)')\s*=")
_POSITION = re.compile(r"\(at line (\d+), column (\d+)\)")


def locate(text: str, path: Sequence[str | int], file: str) -> SourceLocation:
    """The location of a value; if it has no line of its own, of the nearest enclosing table or key.

    Args:
        text: The whole file.
        path: Keys and indices from the top.
        file: Its name.
    """
    target, found, depth = tuple(path), SourceLocation(file, 1, 1), -1
    for key_path, location in _key_locations(text, file):
        shared = len(key_path) if target[: len(key_path)] == key_path else -1
        if shared > depth:
            found, depth = location, shared
    return found


def syntax_location(text: str, fault: str, file: str) -> SourceLocation:
    """The location of a TOML syntax error.

    Args:
        text: The whole file.
        fault: The message of `tomllib`.
        file: Its name.
    """
    lines = text.splitlines() or [""]
    position = _POSITION.search(fault)
    line, column = (
        (int(position[1]), int(position[2])) if position else (len(lines), len(lines[-1]) + 1)
    )
    return SourceLocation(file, line, column, _line(lines, line))


def _key_locations(text: str, file: str) -> Iterator[tuple[KeyPath, SourceLocation]]:
    """Each header and each key with its location, in their order."""
    tables: Counter[str] = Counter()
    table: KeyPath = ()
    for number, line in enumerate(text.splitlines(), start=1):
        if header := _ARRAY_TABLE.match(line):
            table = (*header[1].split("."), tables[header[1]])
            tables[header[1]] += 1
            yield table, _at(file, number, line, header[0])
        elif header := _TABLE.match(line):
            table = tuple(header[1].split("."))
            yield table, _at(file, number, line, header[0])
        elif key := _KEY.match(line):
            name = next(part for part in key.groups() if part is not None)
            yield (*table, name), _at(file, number, line, key[0].rstrip("= \t"))


def _at(file: str, number: int, line: str, marked: str) -> SourceLocation:
    column = len(marked) - len(marked.lstrip()) + 1
    return SourceLocation(file, number, column, line, len(marked.strip()))


def _line(lines: Sequence[str], number: int) -> str:
    return lines[number - 1] if 0 < number <= len(lines) else ""

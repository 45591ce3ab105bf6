"""Sinks for JSON lines: standard output, a file."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TextIO

from visup.agent.model.errors import OutputError
from visup.wording import escaped_json

TIMEOUT_S = 5.0
"""Timeout of one attempt to reach another machine, seconds."""


class JsonLines:
    """Writes one JSON object per line, flushed at once.

    Args:
        name: Name of the sink.
        stream: The stream.
        owned: Whether to close it at the end.
    """

    def __init__(self, name: str, stream: TextIO, *, owned: bool = False) -> None:
        self.name = name
        self._stream = stream
        self._owned = owned

    def deliver(self, record: Mapping[str, Any]) -> None:
        """Write one line."""
        self._stream.write(json_text(record) + "\n")
        self._stream.flush()

    def close(self) -> None:
        """Close the file."""
        if self._owned:
            self._stream.close()


def to_stdout() -> JsonLines:
    """The sink `jsonl:-`."""
    return JsonLines("jsonl:-", sys.stdout)


def to_file(name: str, path: Path) -> JsonLines:
    """The sink of a file, which is appended to.

    Raises:
        OutputError: It cannot be opened.
    """
    try:
        return JsonLines(name, path.open("a", encoding="utf-8"), owned=True)
    except OSError as fault:
        raise OutputError(f"cannot write: {fault.strerror}", where=str(path)) from fault


def json_text(record: Mapping[str, Any]) -> str:
    """A record as one line of JSON without terminal control characters."""
    return escaped_json(record, ensure_ascii=False, separators=(",", ":"), sort_keys=True)

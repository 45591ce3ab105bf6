"""The identity of a run: source, settings with the files they name, and version of visup."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

from visup.agent.model.errors import SourceError
from visup.agent.storage.jsonable import to_jsonable
from visup.archive.inputs import run_inputs
from visup.runs.settings import WatchSettings
from visup.version import __version__

_NO_EFFECT = ("source", "tasks", "rules", "zones", "patience_s")
"""Settings that enter by content, or do not affect the result for a file."""


def run_key(source_hash: str, settings_hash: str, visup: str = __version__) -> str:
    """The key of a run in a lake: 32 hexadecimal digits.

    >>> run_key("a", "b", "1.0")
    '9ae33db443a48876cee79ec4f624b7e9'
    """
    return hashlib.sha256(f"{source_hash}\n{settings_hash}\n{visup}".encode()).hexdigest()[:32]


def content_hash(path: Path) -> str:
    """SHA-256 of a file, or of all files of a folder with their names.

    Raises:
        SourceError: It cannot be read.
    """
    try:
        if not path.is_dir():
            return _file_hash(path)
        digest = hashlib.sha256()
        for name, file in _files(path):
            digest.update(f"{name}\n{_file_hash(file)}\n".encode(errors="surrogateescape"))
        return digest.hexdigest()
    except OSError as fault:
        reason = fault.strerror or str(fault)
        raise SourceError(f"it cannot be read ({reason})", where=str(path)) from fault


def settings_hash(settings: WatchSettings) -> str:
    """SHA-256 of settings: the files they name enter by content, and the source not at all.

    Raises:
        VisupError: A file that they name cannot be read.
    """
    return hashlib.sha256(_canonical(_described(settings)).encode()).hexdigest()


def _described(settings: WatchSettings) -> dict[str, Any]:
    inputs = run_inputs(settings)
    described: dict[str, Any] = {
        f.name: _value(getattr(settings, f.name))
        for f in fields(settings)
        if f.name not in _NO_EFFECT
    }
    named_files = {"tasks": inputs.tasks, "rules": inputs.rules, "zones": inputs.zones}
    return {**described, **named_files, "texts": dict(inputs.texts)}


def _value(value: Any) -> Any:
    """A setting as JSON; an existing file as the hash of its content."""
    if isinstance(value, tuple):
        return [_value(v) for v in value]
    if isinstance(value, Mapping):
        return {str(k): _value(v) for k, v in value.items()}
    if isinstance(value, Path | str) and str(value) and Path(value).exists():
        return f"sha256:{content_hash(Path(value))}"
    return to_jsonable(value)


def _canonical(value: Any) -> str:
    return json.dumps(value, ensure_ascii=True, separators=(",", ":"), sort_keys=True)


def _files(folder: Path) -> Iterator[tuple[str, Path]]:
    for file in sorted(folder.rglob("*")):
        if file.is_file():
            yield file.relative_to(folder).as_posix(), file


def _file_hash(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()

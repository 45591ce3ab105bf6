"""Answers to questions: as CSV, JSON and Parquet, the same values in each."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable, Mapping
from datetime import date, datetime
from io import StringIO
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from visup.agent.model.errors import OutputError, SettingsError
from visup.agent.storage.atomic import replacing, write_whole
from visup.archive.extra import imported

if TYPE_CHECKING:
    import pyarrow as pa


def cell(value: Any) -> str:
    """A value as it stands in a table or in CSV; nothing where it is null."""
    if value is None:
        return ""
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, list | dict):
        return json.dumps(_plain(value), ensure_ascii=False)
    return str(_plain(value))


def as_csv(table: pa.Table) -> str:
    """An answer as CSV, with a head."""
    out = StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(table.column_names)
    columns = [column.to_pylist() for column in table.columns]
    for row in zip(*columns, strict=True):
        writer.writerow([repr(v) if isinstance(v, float) else cell(v) for v in row])
    return out.getvalue()


def as_json(table: pa.Table) -> str:
    """An answer as a JSON list of objects."""
    return json.dumps(answer_rows(table), ensure_ascii=False) + "\n"


def answer_rows(table: pa.Table) -> list[dict[str, Any]]:
    """The rows of an answer as JSON-like values."""
    return [_plain(row) for row in table.to_pylist()]


TEXTS: Mapping[str, Callable[[pa.Table], str]] = MappingProxyType({"csv": as_csv, "json": as_json})
FORMATS = ("table", *TEXTS, "parquet")


def format_of(form: str | None, out: Path | None) -> str:
    """The format that is wanted: the one that is named, else that of the file's ending, else a table.

    Raises:
        SettingsError: There is no such format, or none without a file.
    """
    wanted = form or (out.suffix.removeprefix(".").lower() if out else "table")
    if wanted not in FORMATS:
        raise SettingsError(
            f"there is no format '{wanted}'", expected=f"one of: {', '.join(FORMATS)}"
        )
    if wanted == "parquet" and out is None:
        raise SettingsError("Parquet is written to a file", hint="add --out FILE.parquet")
    if wanted == "table" and out is not None:
        raise SettingsError("a table is shown, not written", hint="choose --format csv")
    return wanted


def write_answer(table: pa.Table, form: str, out: Path) -> None:
    """Write an answer to a file, whole or not at all.

    Raises:
        OutputError: It cannot be written.
    """
    try:
        if form in TEXTS:
            write_whole(out, TEXTS[form](table).encode())
            return
        with replacing(out) as draft:
            imported("pyarrow.parquet").write_table(table, draft)
    except OSError as fault:
        what = f"the file cannot be written ({fault.strerror})"
        raise OutputError(what, where=str(out)) from fault


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(k): _plain(v) for k, v in value.items()}
    if isinstance(value, list):
        return [_plain(v) for v in value]
    if isinstance(value, tuple):  # a pair of a map
        return [_plain(v) for v in value]
    if isinstance(value, datetime | date):
        return value.isoformat()
    if isinstance(value, float) and value != value:
        return None
    return value if isinstance(value, bool | int | float | str) or value is None else str(value)

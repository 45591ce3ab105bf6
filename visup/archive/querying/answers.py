"""Query results as CSV, JSON and Parquet, with the same values in each."""

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
from visup.agent.storage.atomic import replacing, write_atomically
from visup.archive.extra import imported

if TYPE_CHECKING:
    import pyarrow as pa


def cell(value: Any) -> str:
    """A value as text for a table or CSV; empty for null."""
    if value is None:
        return ""
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, list | dict):
        return json.dumps(_plain(value), ensure_ascii=False)
    return str(_plain(value))


def as_csv(table: pa.Table) -> str:
    """A result as CSV with a header."""
    out = StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(table.column_names)
    columns = [column.to_pylist() for column in table.columns]
    for row in zip(*columns, strict=True):
        writer.writerow([repr(v) if isinstance(v, float) else cell(v) for v in row])
    return out.getvalue()


def as_json(table: pa.Table) -> str:
    """A result as a JSON list of objects."""
    return json.dumps(answer_rows(table), ensure_ascii=False) + "\n"


def answer_rows(table: pa.Table) -> list[dict[str, Any]]:
    """The rows of a result as JSON-like values."""
    return [_plain(row) for row in table.to_pylist()]


TEXTS: Mapping[str, Callable[[pa.Table], str]] = MappingProxyType({"csv": as_csv, "json": as_json})
FORMATS = ("table", *TEXTS, "parquet")


def format_of(form: str | None, out: Path | None) -> str:
    """The format: the one named, else that of the file's suffix, else a table.

    Raises:
        SettingsError: The format does not exist, or it needs a file.
    """
    format_name = form or (out.suffix.removeprefix(".").lower() if out else "table")
    if format_name not in FORMATS:
        raise SettingsError(
            f"there is no format '{format_name}'", expected=f"one of: {', '.join(FORMATS)}"
        )
    if format_name == "parquet" and out is None:
        raise SettingsError("Parquet is written to a file", hint="add --out FILE.parquet")
    if format_name == "table" and out is not None:
        raise SettingsError("a table is shown, not written", hint="choose --format csv")
    return format_name


def write_answer(table: pa.Table, form: str, out: Path) -> None:
    """Write a result to a file atomically.

    Raises:
        OutputError: It cannot be written.
    """
    try:
        if form in TEXTS:
            write_atomically(out, TEXTS[form](table).encode())
            return
        with replacing(out) as draft:
            imported("pyarrow.parquet").write_table(table, draft)
    except OSError as fault:
        message = f"the file cannot be written ({fault.strerror})"
        raise OutputError(message, where=str(out)) from fault


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(k): _plain(v) for k, v in value.items()}
    if isinstance(value, list):
        return [_plain(v) for v in value]
    if isinstance(value, tuple):  # an entry of a map
        return [_plain(v) for v in value]
    if isinstance(value, datetime | date):
        return value.isoformat()
    if isinstance(value, float) and value != value:
        return None
    return value if isinstance(value, bool | int | float | str) or value is None else str(value)

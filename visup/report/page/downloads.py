"""Downloadable tables of a run: CSV, and Parquet if pyarrow is installed."""

from __future__ import annotations

import base64
import csv
import json
from collections.abc import Iterator, Mapping, Sequence
from html import escape
from io import BytesIO, StringIO
from typing import TYPE_CHECKING, Any

from visup.agent import Alert, Event
from visup.report.page.summary import SEVERITY_WORDS, called
from visup.report.records import RunData, StateSpan

if TYPE_CHECKING:
    import pyarrow as pa

Row = Mapping[str, Any]
FORMULA = ("=", "+", "-", "@", "\t", "\r")
"""First characters by which spreadsheets recognise a formula."""


def downloads(run: RunData) -> str:
    """Links to the tables, which are embedded in the page."""
    items = "".join(_links(name, rows) for name, rows in tables_of(run).items() if rows)
    return f"<p class=downloads>Download: {items}</p>" if items else ""


def tables_of(run: RunData) -> dict[str, list[Row]]:
    """The tables by name: events, alerts, stages, objects, distances; times in seconds of the source."""
    return {
        "events": [_event(e) for e in run.events],
        "alerts": [_alert(run, a) for a in run.alerts],
        "stages": [_stage(s) for s in run.spans_about("stage")],
        "objects": [{name: getattr(o, name) for name in OBJECT} for o in run.objects],
        "distances": list(_distances(run)),
    }


OBJECT = ("id", "name", "share", "first_seen", "last_seen")


def _event(event: Event) -> Row:
    severity = SEVERITY_WORDS[event.severity]
    return {"time": event.time, "kind": event.kind, "severity": severity, "text": event.text}


def _alert(run: RunData, alert: Alert) -> Row:
    return {
        "id": alert.id,
        "kind": alert.kind,
        "severity": SEVERITY_WORDS[alert.severity],
        "opened": alert.opened,
        "closed": alert.closed,
        "objects": "; ".join(called(run, i) for i in alert.objects),
        "cause": alert.cause,
    }


def _stage(span: StateSpan) -> Row:
    _, task, stage = span.subject
    return {"task": task, "stage": stage, "status": span.value, "from": span.start, "to": span.end}


def _distances(run: RunData) -> Iterator[Row]:
    for sample in run.samples:
        for (a, b), distance in sample.distances.items():
            yield {"time": sample.time, "a": a, "b": b, "gap_px": distance.gap}


def _links(name: str, rows: Sequence[Row]) -> str:
    formats = {"csv": ("text/csv", csv_bytes(rows)), "parquet": (_PARQUET, parquet_bytes(rows))}
    links = (
        f'<a download="{name}.{kind}" href="data:{mime};base64,{_base64(data)}">{kind}</a>'
        for kind, (mime, data) in formats.items()
        if data is not None
    )
    return f"<span>{escape(name)} {' '.join(links)}</span> "


_PARQUET = "application/vnd.apache.parquet"


def _base64(data: bytes) -> str:
    return base64.b64encode(data).decode("ascii")


def csv_bytes(rows: Sequence[Row]) -> bytes:
    """A table as CSV in UTF-8, with formulas disabled for spreadsheets."""
    text = StringIO()
    writer = csv.DictWriter(text, list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows({k: _without_formula(v) for k, v in row.items()} for row in rows)
    return text.getvalue().encode()


def _without_formula(value: Any) -> Any:
    return f"'{value}" if isinstance(value, str) and value.startswith(FORMULA) else value


def parquet_bytes(rows: Sequence[Row]) -> bytes | None:
    """A table as Parquet; None without pyarrow."""
    try:
        import pyarrow.parquet as pq
    except ModuleNotFoundError:
        return None
    buffer = BytesIO()
    pq.write_table(_arrow_table(rows), buffer, compression="zstd")
    return buffer.getvalue()


def _arrow_table(rows: Sequence[Row]) -> pa.Table:
    """The rows, by way of JSON: to convert values of Python pyarrow imports pandas, for 0.4 s."""
    import pyarrow as pa
    import pyarrow.json

    # Texts stay texts, though they read like times.
    texts = [name for name in rows[0] if any(isinstance(r[name], str) for r in rows)]
    schema = pa.schema([(name, pa.string()) for name in texts])
    lines = "\n".join(json.dumps(row) for row in rows).encode()
    table = pyarrow.json.read_json(
        BytesIO(lines),
        read_options=pyarrow.json.ReadOptions(block_size=len(lines) + 1),
        parse_options=pyarrow.json.ParseOptions(explicit_schema=schema),
    )
    return table.select(list(rows[0]))

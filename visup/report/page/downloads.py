"""Tables of a run to download from its page: CSV, and Parquet where pyarrow is installed."""

from __future__ import annotations

import base64
import csv
from collections.abc import Iterator, Mapping, Sequence
from html import escape
from io import BytesIO, StringIO
from typing import Any

from visup.report.page.summary import SEVERITY_WORDS, called
from visup.report.records import RunData

Row = Mapping[str, Any]
FORMULA = ("=", "+", "-", "@", "\t", "\r")
"""What a spreadsheet takes for a formula when a text begins with it."""


def downloads(run: RunData) -> str:
    """Links to the tables; they are in the page itself."""
    items = "".join(_links(name, rows) for name, rows in tables_of(run).items() if rows)
    return f"<p class=downloads>Download: {items}</p>" if items else ""


def tables_of(run: RunData) -> dict[str, list[Row]]:
    """The tables by name: events, alerts, stages, objects, distances; times in seconds of the source."""
    return {
        "events": [
            {
                "time": e.time,
                "kind": e.kind,
                "severity": SEVERITY_WORDS[e.severity],
                "text": e.text,
            }
            for e in run.events
        ],
        "alerts": [
            {
                "id": a.id,
                "kind": a.kind,
                "severity": SEVERITY_WORDS[a.severity],
                "opened": a.opened,
                "closed": a.closed,
                "objects": "; ".join(called(run, i) for i in a.objects),
                "cause": a.cause,
            }
            for a in run.alerts
        ],
        "stages": [
            {
                "task": s.subject[1],
                "stage": s.subject[2],
                "status": s.value,
                "from": s.start,
                "to": s.end,
            }
            for s in run.spans_about("stage")
        ],
        "objects": [
            {
                "id": o.id,
                "name": o.name,
                "share": o.share,
                "first_seen": o.first_seen,
                "last_seen": o.last_seen,
            }
            for o in run.objects
        ],
        "distances": list(_distances(run)),
    }


def _distances(run: RunData) -> Iterator[Row]:
    for sample in run.samples:
        for (a, b), distance in sample.distances.items():
            yield {"time": sample.time, "a": a, "b": b, "gap_px": distance.gap}


def _links(name: str, rows: Sequence[Row]) -> str:
    made = {"csv": ("text/csv", csv_bytes(rows)), "parquet": (_PARQUET, parquet_bytes(rows))}
    shown = (
        f'<a download="{name}.{kind}" href="data:{mime};base64,{_base64(data)}">{kind}</a>'
        for kind, (mime, data) in made.items()
        if data is not None
    )
    return f"<span>{escape(name)} {' '.join(shown)}</span> "


_PARQUET = "application/vnd.apache.parquet"


def _base64(data: bytes) -> str:
    return base64.b64encode(data).decode("ascii")


def csv_bytes(rows: Sequence[Row]) -> bytes:
    """A table as CSV, UTF-8; no text in it is a formula to a spreadsheet."""
    text = StringIO()
    writer = csv.DictWriter(text, list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows({k: _harmless(v) for k, v in row.items()} for row in rows)
    return text.getvalue().encode()


def _harmless(value: Any) -> Any:
    return f"'{value}" if isinstance(value, str) and value.startswith(FORMULA) else value


def parquet_bytes(rows: Sequence[Row]) -> bytes | None:
    """A table as Parquet; None where pyarrow is not installed."""
    try:
        import pyarrow as pa
        import pyarrow.parquet as pq
    except ModuleNotFoundError:
        return None
    place = BytesIO()
    pq.write_table(pa.Table.from_pylist([dict(r) for r in rows]), place, compression="zstd")
    return place.getvalue()

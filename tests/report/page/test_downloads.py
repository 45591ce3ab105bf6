"""Tables to download from the page, and the table of objects."""

from __future__ import annotations

import base64
import csv
import re
from dataclasses import replace
from io import BytesIO, StringIO

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.report.page.test_html import data
from visup.agent import Alert, Severity
from visup.report.page.downloads import csv_bytes, downloads, parquet_bytes, tables_of
from visup.report.page.object_table import MAX_ROWS, object_table
from visup.report.page.sections import FEW_FRAMES, MANY_OBJECTS, alert_filter, shown_frames
from visup.report.records import KeyFrame, ReportedObject, RunData

CELLS = st.text(st.characters(exclude_categories=["Cs", "Cc"]), max_size=12)


@given(st.lists(st.fixed_dictionaries({"time": st.floats(0, 99), "text": CELLS}), min_size=1))
def test_csv_can_be_read_back_and_contains_no_formula(rows: list[dict[str, object]]) -> None:
    back = list(csv.DictReader(StringIO(csv_bytes(rows).decode())))
    assert [float(r["time"]) for r in back] == [r["time"] for r in rows]
    for was, now in zip(rows, back, strict=True):
        assert not now["text"].startswith(("=", "+", "-", "@"))
        assert now["text"].removeprefix("'") == str(was["text"]).removeprefix("'")


def test_parquet_has_the_data_of_the_run() -> None:
    parquet = pytest.importorskip("pyarrow.parquet", reason="needs the extra `tables`")
    for rows in tables_of(data()).values():
        made = parquet_bytes(rows)
        assert made is not None
        assert parquet.read_table(BytesIO(made)).to_pylist() == [dict(r) for r in rows]


TABLE = st.fixed_dictionaries(
    {
        "text": CELLS | st.sampled_from(["2026-11-28", "2026-11-28T10:00:00Z", "1.5", "null"]),
        "maybe": st.none() | CELLS,
        "time": st.floats(allow_nan=False),
        "id": st.none() | st.integers(-(2**40), 2**40),
    }
)


@given(st.lists(TABLE, min_size=1))
def test_types_are_kept_in_parquet(rows: list[dict[str, object]]) -> None:
    parquet = pytest.importorskip("pyarrow.parquet", reason="needs the extra `tables`")
    made = parquet_bytes(rows)
    assert made is not None
    assert parquet.read_table(BytesIO(made)).to_pylist() == rows


def test_each_table_that_has_rows_can_be_downloaded() -> None:
    page = downloads(data())
    found = re.findall(r'download="(\w+)\.csv" href="data:text/csv;base64,([^"]+)"', page)
    tables = tables_of(data())
    assert [name for name, _ in found] == [n for n, rows in tables.items() if rows]
    for name, encoded in found:
        lines = base64.b64decode(encoded).decode().splitlines()
        assert len(lines) == 1 + len(tables[name])
    assert downloads(RunData("nothing.mp4")) == ""


def crowd(count: int) -> RunData:
    frames = tuple(KeyFrame(n, n / 2, b"jpeg", (8, 8), (), n % 5) for n in range(24))
    objects = tuple(ReportedObject(n, "car", 0.9, n * 0.1, n * 0.1 + 2.0) for n in range(count))
    return RunData("road.mp4", duration=40.0, objects=objects, key_frames=frames)


def test_with_many_objects_their_table_replaces_pictures() -> None:
    few, many = crowd(MANY_OBJECTS), crowd(MAX_ROWS + 30)
    assert len(shown_frames(few)) == 24
    shown = shown_frames(many)
    assert len(shown) == FEW_FRAMES
    assert [k.time for k in shown] == sorted(k.time for k in shown)
    assert min(k.weight for k in shown) == 4 - (FEW_FRAMES > 4)
    assert object_table(many).count("<tr>") == MAX_ROWS + 1  # and one of headings
    assert "30 more are in the table" in object_table(many)


def test_only_a_longer_list_of_alerts_has_a_filter() -> None:
    one = Alert(1, "near_miss", Severity.WARNING, 1.0, 1.0, (), "They are close.")
    assert alert_filter(replace(data(), alerts=(one,) * 3)) == ""
    bar = alert_filter(replace(data(), alerts=(one,) * 4))
    assert '<option value="near_miss">near miss</option>' in bar

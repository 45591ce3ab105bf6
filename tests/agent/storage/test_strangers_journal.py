"""Journals that somebody made to do harm: refused in words, in bounded time and memory."""

from __future__ import annotations

import json
import os
import sqlite3
import time
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.agent.scripted import Scripted, frames
from tests.oracles.hardening.attack_files import change_seen
from visup.agent import Percept, Region
from visup.agent.cycle.agent import Agent
from visup.agent.model.errors import OutputError
from visup.agent.storage.codec import pack_observation, unpack_observation
from visup.agent.storage.journal import Journal
from visup.agent.storage.journal_reader import JOURNAL, Recording


def region(index: int) -> Region:
    square = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], np.float32)
    return Region(1, (0, 0, 2, 2), np.ones((2, 2), bool), square, (0.5, 0.5), 4)


@pytest.fixture
def run(tmp_path: Path) -> Path:
    journal = Journal(tmp_path / JOURNAL)
    Agent([Scripted("eye", ("region",), region)], observers=(journal.record,)).run(frames(4))
    journal.note(settings={}, verdict="succeeded")
    journal.close()
    return tmp_path


def sql(run: Path, *statements: str) -> None:
    db = sqlite3.connect(run / JOURNAL)
    for statement in statements:
        db.execute(statement)
    db.commit()
    db.close()


ENDLESS = "WITH RECURSIVE n(x) AS (SELECT 1 UNION ALL SELECT x + 1 FROM n) SELECT"


@pytest.mark.parametrize(
    "statements",
    [
        ("DROP TABLE steps", f"CREATE VIEW steps AS {ENDLESS} x AS frame_index, 0.0 AS time, '' AS "
         "summary, x'' AS seen, 0 AS crc FROM n"),
        ("DROP TABLE run", f"CREATE VIEW run AS {ENDLESS} 'k' AS key, '1' AS value FROM n"),
        ("CREATE TABLE more (x)",),
        ("CREATE TRIGGER t AFTER INSERT ON steps BEGIN DELETE FROM steps; END",),
        ("DROP INDEX events_by_time", "CREATE INDEX events_by_time ON events (abs(time))"),
        ("ALTER TABLE steps ADD COLUMN more INTEGER AS (frame_index * 2)",),
        ("CREATE VIRTUAL TABLE found USING fts5(x)",),
    ],
)  # fmt: skip
def test_other_tables_are_refused_before_they_are_read(run: Path, statements: tuple[str]) -> None:
    try:
        sql(run, *statements)
    except sqlite3.OperationalError as missing:
        pytest.skip(f"this SQLite cannot do it: {missing}")
    begin = time.process_time()
    with pytest.raises(OutputError, match="not a journal"):
        Recording.open(run)
    with pytest.raises(OutputError, match="not a journal"):
        Journal(run / JOURNAL, resume=True)
    assert time.process_time() - begin < 2.0


Change = Callable[[dict[str, Any]], Any]


def first_value(document: dict[str, Any]) -> dict[str, Any]:
    found: dict[str, Any] = document["reports"][0]["percepts"][0][1]
    return found


CHANGES: dict[str, Change] = {
    "a box of 20 gigabytes": lambda d: first_value(d).update(
        bbox=[0, 0, 200_000, 100_000], mask=[20_000_000_000]
    ),
    "a box of negative size": lambda d: first_value(d).update(bbox=[0, 0, -5, -5], mask=[25]),
    "masks that are too much together": lambda d: d["reports"][0].update(
        percepts=[
            ["region", {**first_value(d), "id": n, "bbox": [0, 0, 4000, 4000], "mask": [16_000_000]}, 0.0,
             "eye", 1.0]
            for n in range(100)
        ]
    ),
    "runs that are no numbers": lambda d: first_value(d).update(mask=["x"]),
    "a chain that is none": lambda d: first_value(d)["contour"].update(of="9" * 10),
    "a chain from nowhere": lambda d: first_value(d)["contour"].update({"from": [10**30, 0]}),
    "an array of objects": lambda d: first_value(d).update(
        contour={"$": "array", "dtype": "|O", "shape": [1], "of": "AAAAAAAAAAA="}
    ),
    "an array larger than its bytes": lambda d: first_value(d).update(
        contour={"$": "array", "dtype": "<f4", "shape": [10**12, 2], "of": ""}
    ),
    "a region that is a number": lambda d: d["reports"][0]["percepts"][0].__setitem__(1, 5),
    "a region outside of the frame": lambda d: first_value(d).update(bbox=[100, 100, 2, 2]),
    "a frame without end": lambda d: d.update(frame_size=[10**9, 10**9]),
    "a time that is none": lambda d: d.update(time="NaN"),
    "confidence of two": lambda d: d["reports"][0]["percepts"][0].__setitem__(4, 2.0),
    "a record of another kind": lambda d: first_value(d).update({"$": "Observation"}),
    "too many fields": lambda d: first_value(d).update(more=1),
    "nested without end": lambda d: d["reports"][0]["percepts"][0].__setitem__(
        1, json.loads("[" * 150 + "]" * 150)
    ),
    "reports that are no list": lambda d: d.update(reports={"a": 1}),
}  # fmt: skip


@pytest.mark.parametrize("change", CHANGES.values(), ids=CHANGES)
def test_percepts_that_no_behaviour_could_report_are_refused(run: Path, change: Change) -> None:
    change_seen(run, 2, change)
    given: list[object] = []
    with pytest.raises(OutputError):
        given.extend(Recording.open(run).observations())
    assert len(given) <= 2


def test_eighty_million_empty_lists_are_refused_without_using_memory(run: Path) -> None:
    text = b'{"frame_index":2,"time":0,"frame_size":[6,4],"reports":[' + b"[]," * 10**7 + b"[]]}"
    with pytest.raises(OutputError, match="values"):
        unpack_observation(zlib.compress(text, 1))


@pytest.mark.parametrize(
    "value",
    [10**400_000, "\ud800", {"\ud800": 1}, [[]] * 4_100_000],
    ids=["long number", "half a character", "as a key", "many lists"],
)
def test_values_that_could_not_be_read_back_are_not_written(value: object) -> None:
    (step,) = Agent([Scripted("eye", ("x",))]).steps(frames(1))
    seen = step.observation
    (report,) = seen.reports
    good = Percept("x", 1, 0.0, "eye")
    from dataclasses import replace

    bad = replace(report, percepts=(Percept("x", value, 0.0, "eye"),))
    other = replace(report, behaviour="other", percepts=(good,))
    back = unpack_observation(pack_observation(replace(seen, reports=(bad, other))))
    assert back.reports[0].percepts == ()
    assert "not recorded" in back.reports[0].error
    assert back.reports[1].percepts == (good,)


def test_masked_arrays_round_trip() -> None:
    (step,) = Agent([Scripted("eye", ("x",))]).steps(frames(1))
    from dataclasses import replace

    value = np.ma.MaskedArray([1.0, np.nan, 3.0], [False, True, False])
    (report,) = step.observation.reports
    told = replace(report, percepts=(Percept("x", value, 0.0, "eye"),))
    (back,) = unpack_observation(pack_observation(replace(step.observation, reports=(told,)))).of(
        "x"
    )
    assert back.mask.tolist() == [False, True, False]
    assert back.compressed().tolist() == [1.0, 3.0]


@pytest.mark.parametrize(
    "text",
    ["1" * 5000, "[" * 10**5, '"' + "x" * (17 * 2**20) + '"', "[]"],
    ids=["number", "deep", "long", "list"],
)
def test_invalid_records_are_refused(run: Path, text: str) -> None:
    db = sqlite3.connect(run / JOURNAL)
    db.execute("UPDATE steps SET summary = ?", (text,))
    db.commit()
    db.close()
    with pytest.raises(OutputError):
        list(Recording.open(run).summaries())


def test_a_pipe_in_place_of_a_journal_does_not_block(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / JOURNAL)
    with pytest.raises(OutputError):
        Recording.open(tmp_path)


def test_a_pipe_in_place_of_a_segment_is_ignored(run: Path) -> None:
    os.mkfifo(run / "journal-2.sqlite")
    assert Recording.open(run).count() == 4

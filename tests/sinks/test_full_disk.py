"""Alerts on a disk without room: they are noted, sent and crossed off in room that was set aside."""

from __future__ import annotations

import os
import sqlite3
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.full_disk import no_room
from tests.sinks.test_deliveries import Flaky, wait_for
from visup.sinks import delivery_log, durable_outbox
from visup.sinks.delivery_log import DELIVERY, DeliveryLog
from visup.sinks.durable_outbox import DurableOutbox


def alert(number: int, state: str = "opened", text: str = "") -> dict[str, Any]:
    return {"record": "alert", "id": number, "opened": 0.1 * number, "state": state, "text": text}


def taken(log: DeliveryLog, sink: str) -> list[Mapping[str, Any]]:
    """What waits for a sink, crossed off one by one."""
    records: list[Mapping[str, Any]] = []
    while waiting := log.oldest(sink):
        records.append(waiting[1])
        log.done(waiting[0])
    return records


@pytest.fixture(autouse=True)
def _quick(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(delivery_log, "SYNCHRONOUS", "OFF")


@pytest.mark.parametrize("restarts", [0, 1])
def test_on_a_full_disk_hundreds_of_alerts_are_stored_and_removed(
    tmp_path: Path, restarts: int
) -> None:
    path = tmp_path / "d.sqlite"
    log = DeliveryLog(path)
    with no_room(tmp_path):
        for part in range(restarts + 1):
            for n in range(100 * part, 100 * (part + 1)):
                log.add(["a", "b"], [alert(n, text="x" * 1000)], n)
            if part < restarts:
                log.close()
                log = DeliveryLog(path)
        assert log.last_frame == 100 * (restarts + 1) - 1
        for sink in ("a", "b"):
            assert [r["id"] for r in taken(log, sink)] == list(range(100 * (restarts + 1)))
    log.close()


def test_without_a_reserve_no_part_of_a_step_is_stored(tmp_path: Path) -> None:
    log = DeliveryLog(tmp_path / "d.sqlite")

    def fill() -> None:
        for n in range(10_000):
            log.add(["a"], [alert(n, text="x" * 2000), alert(n, "closed", "x" * 2000)], n)

    with no_room(tmp_path), pytest.raises(sqlite3.Error):
        fill()
    ids = [(r["id"], r["state"]) for r in taken(log, "a")]
    assert ids == [(n, s) for n in range(log.last_frame + 1) for s in ("opened", "closed")]
    log.close()


@settings(max_examples=15)
@given(st.lists(st.tuples(st.integers(0, 5), st.sampled_from(["opened", "closed"]), st.booleans())))
def test_an_alert_is_stored_once_even_by_several_processes(
    tmp_path_factory: pytest.TempPathFactory, acts: list[tuple[int, str, bool]]
) -> None:
    path = tmp_path_factory.mktemp("log") / "d.sqlite"
    log = DeliveryLog(path)
    log.begin()
    told: list[tuple[int, str]] = []
    for number, state, killed in acts:
        log.add(["a"], [alert(number, state)])
        told += [(number, state)] if (number, state) not in told else []
        if killed:
            log.close()
            log = DeliveryLog(path)
    records = taken(log, "a")
    assert [(r["id"], r["state"]) for r in records] == told
    assert len({r[DELIVERY] for r in records}) == len(records)
    log.begin()  # runs that do not follow from these have alerts of their own
    log.add(["a"], [alert(1)])
    (new,) = taken(log, "a")
    assert new[DELIVERY] not in {r[DELIVERY] for r in records}
    log.close()


def test_delivery_ids_are_derived_from_alerts(tmp_path: Path) -> None:
    log = DeliveryLog(tmp_path / "d.sqlite")
    first = log.labelled(alert(3))[DELIVERY]
    log.close()
    log = DeliveryLog(tmp_path / "d.sqlite")
    assert log.labelled(alert(3, text="told by another process"))[DELIVERY] == first
    assert log.labelled(alert(3, "closed"))[DELIVERY] != first
    assert log.labelled(alert(4))[DELIVERY] != first
    log.close()


def test_a_sent_record_that_cannot_be_removed_is_not_sent_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(durable_outbox, "INITIAL_WAIT_S", 0.01)
    log = DeliveryLog(tmp_path / "d.sqlite")
    faults = [sqlite3.OperationalError("database or disk is full")] * 3
    done = log.done

    def failing(number: int) -> None:
        if faults:
            raise faults.pop()
        done(number)

    monkeypatch.setattr(log, "done", failing)
    sink = Flaky()
    outbox = DurableOutbox(sink, "0", log)
    log.add(["0"], [{"n": 1}])
    log.add(["0"], [{"n": 2}])
    outbox.wake()
    wait_for(lambda: log.count("0") == 0)
    outbox.close(1.0)
    log.close()
    assert sink.got == [1, 2]


def test_a_transaction_cut_short_by_a_kill_is_undone_and_the_reserve_kept(tmp_path: Path) -> None:
    path = tmp_path / "d.sqlite"
    log = DeliveryLog(path)
    log.add(["a"], [alert(n, text="x" * 1000) for n in range(50)], 1)
    log.close()
    if (child := os.fork()) == 0:
        db = sqlite3.connect(path, isolation_level=None)
        db.execute("PRAGMA journal_mode=PERSIST")
        db.execute("PRAGMA cache_size=2")  # so that pages are written before the end
        db.execute("BEGIN IMMEDIATE")
        db.execute("UPDATE waiting SET record = 'spoilt'")
        os._exit(9)
    os.waitpid(child, 0)
    log = DeliveryLog(path)
    with no_room(tmp_path):
        log.add(["a"], [alert(n) for n in range(50, 100)], 2)
        assert [r["id"] for r in taken(log, "a")] == list(range(100))
    log.close()


def test_a_file_of_an_earlier_version_is_read(tmp_path: Path) -> None:
    path = tmp_path / "d.sqlite"
    db = sqlite3.connect(path, isolation_level=None)
    db.execute("PRAGMA journal_mode=WAL")
    db.executescript(
        """CREATE TABLE waiting (
            number INTEGER PRIMARY KEY AUTOINCREMENT, sink TEXT NOT NULL, record TEXT NOT NULL);
        CREATE TABLE told (only INTEGER PRIMARY KEY CHECK (only = 0), frame_index INTEGER NOT NULL);
        INSERT INTO told VALUES (0, 7);
        INSERT INTO waiting (sink, record) VALUES ('a', '{"record": "alert", "id": 1}');"""
    )
    db.close()
    log = DeliveryLog(path)
    assert log.last_frame == 7
    log.add(["a"], [alert(2)], 8)
    assert [r["id"] for r in taken(log, "a")] == [1, 2]
    log.close()

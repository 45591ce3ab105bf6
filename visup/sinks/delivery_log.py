"""Records that sinks have not taken yet, in a file: they outlive the process, and are sent by the next.

What a step tells is noted for all sinks in one transaction, with the number of its frame, before any of it is
sent: whoever goes on after a kill knows what was noted, and notes what was not. The name of a delivery
follows from the alert, and none is noted twice. On a full disk all this goes on in room that was set aside.
"""

from __future__ import annotations

import json
import sqlite3
import threading
import uuid
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from visup.agent.model.errors import OutputError
from visup.agent.storage.disk_reserve import PageReserve, lengthen
from visup.sinks.lines import json_text

SCHEMA = """
CREATE TABLE IF NOT EXISTS waiting (
    number INTEGER PRIMARY KEY AUTOINCREMENT, sink TEXT NOT NULL, record TEXT NOT NULL);
CREATE TABLE IF NOT EXISTS told (only INTEGER PRIMARY KEY CHECK (only = 0), frame_index INTEGER NOT NULL);
CREATE TABLE IF NOT EXISTS course (only INTEGER PRIMARY KEY CHECK (only = 0), name TEXT NOT NULL);
CREATE TABLE IF NOT EXISTS noted (number INTEGER PRIMARY KEY AUTOINCREMENT, delivery TEXT NOT NULL UNIQUE);
CREATE TABLE IF NOT EXISTS reserve (filling BLOB);
DELETE FROM reserve;
"""
RESERVE_BYTES, LOG_BYTES = 2**20, 2**19
"""Set aside for a full disk: pages for some hundred records, and the log of one change."""

MOST_NOTED = 4000
"""Alerts that are remembered as noted: far more than open between two checkpoints."""

SYNCHRONOUS = "FULL"
"""What is noted is on the disk before it is sent, also where the power goes; tests need not wait for it."""

MOST_WAITING = 10_000
"""Records of one sink; beyond, the oldest are lost."""

DELIVERY = "delivery"
"""Key of a record: the same when it is sent again because nobody knows whether it arrived."""


class DeliveryLog:
    """What waits, by sink.

    Args:
        path: The file; made if it is not there.

    Raises:
        OutputError: It cannot be read or written.
    """

    def __init__(self, path: Path) -> None:
        self._lock = threading.Lock()
        try:
            self._db = sqlite3.connect(path, isolation_level=None, check_same_thread=False)
            # Its log keeps its length and is written over, which needs no room; see `disk_reserve`.
            self._db.execute("PRAGMA journal_mode=PERSIST")
            self._db.execute(f"PRAGMA synchronous={SYNCHRONOUS}")
            self._db.executescript(SCHEMA)
            self._name_course(anew=False)
        except sqlite3.Error as fault:
            raise OutputError(
                f"the queue of undelivered alerts cannot be kept ({fault})",
                where=str(path),
                hint="check that the folder is writable and has room, or delete this file",
            ) from fault
        self._reserve = PageReserve(
            RESERVE_BYTES, "INSERT INTO reserve VALUES (zeroblob(?))", "DELETE FROM reserve"
        )
        self._reserve.keep(self._db)
        with suppress(OSError):
            lengthen(path.with_name(f"{path.name}-journal"), LOG_BYTES)

    @property
    def told_frame(self) -> int:
        """Number of the last frame whose alerts were noted; -1 before the first."""
        with self._lock:
            row = self._db.execute("SELECT frame_index FROM told").fetchone()
        return int(row[0]) if row else -1

    def begin(self) -> None:
        """A new run counts its frames and alerts from nothing; what waits still waits."""
        with self._lock:
            self._db.execute("DELETE FROM told")
            self._name_course(anew=True)

    def labelled(self, record: Mapping[str, Any]) -> dict[str, Any]:
        """A record with the name of its delivery: that of an alert is the same whoever tells it."""
        if record.get("record") != "alert":
            return {**record, DELIVERY: uuid.uuid4().hex}
        told = f"{record['id']} {record['opened']!r} {record['state']}"
        return {**record, DELIVERY: uuid.uuid5(self._course, told).hex}

    def add(
        self,
        sinks: Sequence[str],
        records: Sequence[Mapping[str, Any]],
        frame_index: int | None = None,
    ) -> int:
        """Note records for all sinks, all or none of them; alerts that were noted before are left out.

        Args:
            sinks: Their keys.
            records: In the order in which they are to be sent.
            frame_index: Of the step that tells them; None of what no step tells.

        Returns:
            How many old records were lost, since too many wait.

        Raises:
            sqlite3.Error: They cannot be written.
        """
        labelled = [r if DELIVERY in r else self.labelled(r) for r in records]
        with self._lock:
            self._reserve.keep(self._db)
            self._db.execute("BEGIN IMMEDIATE")
            try:
                texts = [json_text(r) for r in labelled if self._is_new(r)]
                rows = [(sink, text) for text in texts for sink in sinks]
                self._db.executemany("INSERT INTO waiting (sink, record) VALUES (?, ?)", rows)
                if frame_index is not None:
                    self._db.execute("INSERT OR REPLACE INTO told VALUES (0, ?)", (frame_index,))
                lost = sum(self._shorten(sink) for sink in sinks)
                self._db.execute("COMMIT")
            except sqlite3.Error:
                if self._db.in_transaction:
                    self._db.execute("ROLLBACK")
                raise
        return lost

    def oldest(self, sink: str) -> tuple[int, dict[str, Any]] | None:
        """The next record for a sink with its number, or None."""
        sql = "SELECT number, record FROM waiting WHERE sink = ? ORDER BY number LIMIT 1"
        with self._lock:
            row = self._db.execute(sql, (sink,)).fetchone()
        return (int(row[0]), json.loads(row[1])) if row else None

    def done(self, number: int) -> None:
        """A record was taken."""
        with self._lock:
            self._db.execute("DELETE FROM waiting WHERE number = ?", (number,))

    def count(self, sink: str) -> int:
        """How many records wait for a sink."""
        with self._lock:
            sql = "SELECT count(*) FROM waiting WHERE sink = ?"
            return int(self._db.execute(sql, (sink,)).fetchone()[0])

    def close(self) -> None:
        """Close the file."""
        with self._lock:
            self._db.close()

    def _name_course(self, *, anew: bool) -> None:
        """Find or draw the name of runs that follow one another: their alerts are numbered together."""
        found = self._db.execute("SELECT name FROM course").fetchone()
        if anew or not found:
            found = (uuid.uuid4().hex,)
            self._db.execute("INSERT OR REPLACE INTO course VALUES (0, ?)", found)
        self._course = uuid.UUID(found[0])

    def _is_new(self, record: Mapping[str, Any]) -> bool:
        """Note an alert; False when it was noted before, perhaps by a process that is gone."""
        if record.get("record") != "alert":
            return True
        sql = "INSERT OR IGNORE INTO noted (delivery) VALUES (?)"
        added = self._db.execute(sql, (record[DELIVERY],))
        if added.rowcount:
            old = "DELETE FROM noted WHERE number <= ?"
            self._db.execute(old, ((added.lastrowid or 0) - MOST_NOTED,))
        return bool(added.rowcount)

    def _shorten(self, sink: str) -> int:
        sql = (
            "DELETE FROM waiting WHERE number IN (SELECT number FROM waiting WHERE sink = ? "
            "ORDER BY number DESC LIMIT -1 OFFSET ?)"
        )
        return self._db.execute(sql, (sink, MOST_WAITING)).rowcount

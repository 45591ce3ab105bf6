"""A persistent queue of records that sinks have not accepted yet, which survives the process.

The records of a step are stored for all sinks in one transaction with its frame number before any is sent, so
that a resumed process knows which are missing. The id of a delivery is derived from the alert, and none is
stored twice. On a full disk a reserve is used.
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
from visup.agent.storage.disk_reserve import PageReserve, preallocate
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
RESERVE_BYTES, ROLLBACK_LOG_BYTES = 2**20, 2**19
"""Reserved for a full disk: pages for some hundred records, and the log of one transaction."""

MAX_REMEMBERED = 4000
"""Maximum number of remembered alerts: far more than open between two checkpoints."""

SYNCHRONOUS = "FULL"
"""Records are on disk before they are sent, even if the power fails; tests relax this."""

MAX_WAITING = 10_000
"""Maximum records per sink; beyond it the oldest are lost."""

DELIVERY = "delivery"
"""Key of the delivery id of a record, which is unchanged when the record is sent again."""


class DeliveryLog:
    """The queues of all sinks.

    Args:
        path: The file; created if missing.

    Raises:
        OutputError: It cannot be read or written.
    """

    def __init__(self, path: Path) -> None:
        self._lock = threading.Lock()
        try:
            self._db = sqlite3.connect(path, isolation_level=None, check_same_thread=False)
            # The log keeps its length and is overwritten, which needs no space; see `disk_reserve`.
            self._db.execute("PRAGMA journal_mode=PERSIST")
            self._db.execute(f"PRAGMA synchronous={SYNCHRONOUS}")
            self._db.executescript(SCHEMA)
            self._load_sequence_id(new=False)
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
            preallocate(path.with_name(f"{path.name}-journal"), ROLLBACK_LOG_BYTES)

    @property
    def last_frame(self) -> int:
        """Number of the last frame whose alerts were stored; -1 before the first."""
        with self._lock:
            row = self._db.execute("SELECT frame_index FROM told").fetchone()
        return int(row[0]) if row else -1

    def begin(self) -> None:
        """Begin a new run, with frames and alerts counted from 0; waiting records stay."""
        with self._lock:
            self._db.execute("DELETE FROM told")
            self._load_sequence_id(new=True)

    def labelled(self, record: Mapping[str, Any]) -> dict[str, Any]:
        """A record with its delivery id, which for an alert does not depend on the process."""
        if record.get("record") != "alert":
            return {**record, DELIVERY: uuid.uuid4().hex}
        key = f"{record['id']} {record['opened']!r} {record['state']}"
        return {**record, DELIVERY: uuid.uuid5(self._sequence_id, key).hex}

    def add(
        self,
        sinks: Sequence[str],
        records: Sequence[Mapping[str, Any]],
        frame_index: int | None = None,
    ) -> int:
        """Store records for all sinks atomically; alerts that were stored before are skipped.

        Args:
            sinks: Keys of the sinks.
            records: Records in order of delivery.
            frame_index: Frame of their step; None for records without a step.

        Returns:
            Number of old records lost because too many were waiting.

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
                lost = sum(self._drop_oldest(sink) for sink in sinks)
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
        """Remove an accepted record."""
        with self._lock:
            self._db.execute("DELETE FROM waiting WHERE number = ?", (number,))

    def count(self, sink: str) -> int:
        """Number of records waiting for a sink."""
        with self._lock:
            sql = "SELECT count(*) FROM waiting WHERE sink = ?"
            return int(self._db.execute(sql, (sink,)).fetchone()[0])

    def close(self) -> None:
        """Close the file."""
        with self._lock:
            self._db.close()

    def _load_sequence_id(self, *, new: bool) -> None:
        """Load or draw the id of a sequence of runs, whose alerts are numbered together."""
        found = self._db.execute("SELECT name FROM course").fetchone()
        if new or not found:
            found = (uuid.uuid4().hex,)
            self._db.execute("INSERT OR REPLACE INTO course VALUES (0, ?)", found)
        self._sequence_id = uuid.UUID(found[0])

    def _is_new(self, record: Mapping[str, Any]) -> bool:
        """Store the id of an alert; False if it was stored before, perhaps by an earlier process."""
        if record.get("record") != "alert":
            return True
        sql = "INSERT OR IGNORE INTO noted (delivery) VALUES (?)"
        added = self._db.execute(sql, (record[DELIVERY],))
        if added.rowcount:
            delete = "DELETE FROM noted WHERE number <= ?"
            self._db.execute(delete, ((added.lastrowid or 0) - MAX_REMEMBERED,))
        return bool(added.rowcount)

    def _drop_oldest(self, sink: str) -> int:
        sql = (
            "DELETE FROM waiting WHERE number IN (SELECT number FROM waiting WHERE sink = ? "
            "ORDER BY number DESC LIMIT -1 OFFSET ?)"
        )
        return self._db.execute(sql, (sink, MAX_WAITING)).rowcount

"""Records that sinks have not taken yet, in a file: they outlive the process, and are sent by the next.

What a step tells is noted for all sinks in one transaction, with the number of its frame, before any of it is
sent: whoever goes on after a kill knows what was noted, and notes what was not.
"""

from __future__ import annotations

import json
import sqlite3
import threading
import uuid
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from visup.agent.model.errors import OutputError
from visup.sinks.lines import json_text

SCHEMA = """
CREATE TABLE IF NOT EXISTS waiting (
    number INTEGER PRIMARY KEY AUTOINCREMENT, sink TEXT NOT NULL, record TEXT NOT NULL);
CREATE TABLE IF NOT EXISTS told (only INTEGER PRIMARY KEY CHECK (only = 0), frame_index INTEGER NOT NULL);
"""
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
            self._db.execute("PRAGMA journal_mode=WAL")
            self._db.execute("PRAGMA synchronous=NORMAL")
            self._db.executescript(SCHEMA)
        except sqlite3.Error as fault:
            raise OutputError(
                f"the queue of undelivered alerts cannot be kept ({fault})",
                where=str(path),
                hint="check that the folder is writable and has room, or delete this file",
            ) from fault

    @property
    def told_frame(self) -> int:
        """Number of the last frame whose alerts were noted; -1 before the first."""
        with self._lock:
            row = self._db.execute("SELECT frame_index FROM told").fetchone()
        return int(row[0]) if row else -1

    def begin(self) -> None:
        """A new run counts its frames from nothing; what waits still waits."""
        with self._lock:
            self._db.execute("DELETE FROM told")

    def add(
        self,
        sinks: Sequence[str],
        records: Sequence[Mapping[str, Any]],
        frame_index: int | None = None,
    ) -> int:
        """Note records for all sinks, all or none of them.

        Args:
            sinks: Their keys.
            records: In the order in which they are to be sent.
            frame_index: Of the step that tells them; None of what no step tells.

        Returns:
            How many old records were lost, since too many wait.

        Raises:
            sqlite3.Error: They cannot be written.
        """
        texts = [json_text({**r, DELIVERY: uuid.uuid4().hex}) for r in records]
        with self._lock:
            self._db.execute("BEGIN IMMEDIATE")
            try:
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

    def _shorten(self, sink: str) -> int:
        sql = (
            "DELETE FROM waiting WHERE number IN (SELECT number FROM waiting WHERE sink = ? "
            "ORDER BY number DESC LIMIT -1 OFFSET ?)"
        )
        return self._db.execute(sql, (sink, MOST_WAITING)).rowcount

"""The journal: what happened in a run, in one SQLite file, written step by step.

Write-ahead logging makes each step durable as a whole: after a crash the journal holds every step
up to the last one that was committed, and can be read while the run goes on.
"""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from visup.agent.agent import Step
from visup.agent.encode import event_line, object_line, plain
from visup.agent.errors import OutputError
from visup.agent.records import Alert, Event, Frame

APPLICATION_ID = 0x56495355  # "VISU"
VERSION = 1

SCHEMA = """
CREATE TABLE run (key TEXT PRIMARY KEY, value TEXT NOT NULL) WITHOUT ROWID;
CREATE TABLE steps (frame_index INTEGER PRIMARY KEY, time REAL NOT NULL, summary TEXT NOT NULL);
CREATE TABLE events (
    number INTEGER PRIMARY KEY, frame_index INTEGER NOT NULL, time REAL NOT NULL,
    kind TEXT NOT NULL, text TEXT NOT NULL, record TEXT NOT NULL);
CREATE TABLE alerts (
    id INTEGER PRIMARY KEY, kind TEXT NOT NULL, severity TEXT NOT NULL, opened REAL NOT NULL,
    closed REAL, cause TEXT NOT NULL, record TEXT NOT NULL);
CREATE INDEX events_by_time ON events (time);
"""


class Journal:
    """Writes a run as it goes: give its `record` to an agent as an observer, close it at the end.

    Args:
        path: The file; it must not exist yet.

    Raises:
        OutputError: It cannot be written.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            self._db = sqlite3.connect(path, isolation_level=None)
            self._db.execute("PRAGMA journal_mode=WAL")
            self._db.execute("PRAGMA synchronous=NORMAL")
            self._db.execute(f"PRAGMA application_id={APPLICATION_ID}")
            self._db.execute(f"PRAGMA user_version={VERSION}")
            self._db.executescript(SCHEMA)
        except sqlite3.Error as fault:
            raise _unwritable(path, fault) from fault

    def note(self, **facts: Any) -> None:
        """Store facts about the run (settings, source, verdict, ...), replacing older ones."""
        rows = [(key, _json(value)) for key, value in facts.items()]
        self._write([("INSERT OR REPLACE INTO run VALUES (?, ?)", row) for row in rows])

    def record(self, step: Step, frame: Frame) -> None:
        """Write one step, wholly or not at all.

        Raises:
            OutputError: The disk is full or the file has become unwritable; earlier steps stay.
        """
        statements: list[tuple[str, tuple[Any, ...]]] = [
            (
                "INSERT INTO steps VALUES (?, ?, ?)",
                (step.frame_index, step.time, _json(summary(step))),
            )
        ]
        statements += [
            ("INSERT INTO events VALUES (NULL, ?, ?, ?, ?, ?)", _event_row(e)) for e in step.events
        ]
        statements += [
            ("INSERT OR REPLACE INTO alerts VALUES (?, ?, ?, ?, ?, ?, ?)", _alert_row(a))
            for a in step.alerts
        ]
        self._write(statements)

    def close(self) -> None:
        """Fold the log into the one file and close it."""
        try:
            self._db.execute("PRAGMA wal_checkpoint(TRUNCATE)")
            self._db.close()
        except sqlite3.Error as fault:
            raise _unwritable(self.path, fault) from fault

    def _write(self, statements: list[tuple[str, tuple[Any, ...]]]) -> None:
        try:
            self._db.execute("BEGIN")
            for sql, row in statements:
                self._db.execute(sql, row)
            self._db.execute("COMMIT")
        except sqlite3.Error as fault:
            if self._db.in_transaction:
                self._db.execute("ROLLBACK")
            raise _unwritable(self.path, fault) from fault


def summary(step: Step) -> dict[str, Any]:
    """A step in short: objects, relations, tasks, health, directives, what the behaviours did."""
    mind = step.mind
    return {
        "objects": [object_line(b) for _, b in sorted(mind.objects.items())],
        "relations": plain(mind.relations),
        "couplings": plain(mind.couplings),
        "tasks": plain(mind.tasks),
        "health": plain(mind.health),
        "unknown": plain(mind.unknown),
        "directives": plain(step.directives),
        "hypotheses": plain(step.observation.of("hypothesis")),
        "behaviours": {r.behaviour: [r.state.value, r.error] for r in step.reports},
    }


def read_events(path: Path) -> Iterator[dict[str, Any]]:
    """Events of a journal, in the order in which they were told.

    Raises:
        OutputError: The file is not a journal.
    """
    return (json.loads(row[0]) for row in _query(path, "SELECT record FROM events ORDER BY number"))


def read_facts(path: Path) -> Mapping[str, Any]:
    """Facts about the run, as given to `Journal.note`."""
    return {key: json.loads(value) for key, value in _query(path, "SELECT key, value FROM run")}


def read_steps(path: Path) -> Iterator[dict[str, Any]]:
    """Summaries of all steps, in order, with frame index and time."""
    rows = _query(path, "SELECT frame_index, time, summary FROM steps ORDER BY frame_index")
    return ({"frame_index": i, "time": t, **json.loads(s)} for i, t, s in rows)


def export_events(journal: Path, target: Path) -> None:
    """Write `events.jsonl` from a journal: one event a line.

    Raises:
        OutputError: `target` cannot be written, or `journal` cannot be read.
    """
    lines = [_json(event) + "\n" for event in read_events(journal)]
    try:
        target.write_text("".join(lines), encoding="utf-8")
    except OSError as fault:
        raise OutputError(f"cannot write: {fault.strerror}", where=str(target)) from fault


def _query(path: Path, sql: str) -> list[tuple[Any, ...]]:
    try:
        db = sqlite3.connect(f"{path.absolute().as_uri()}?mode=ro", uri=True)
        try:
            return db.execute(sql).fetchall()
        finally:
            db.close()
    except sqlite3.Error as fault:
        raise OutputError(f"this is not a journal ({fault})", where=str(path)) from fault


def _event_row(event: Event) -> tuple[Any, ...]:
    return event.frame_index, event.time, event.kind, event.text, _json(event_line(event))


def _alert_row(a: Alert) -> tuple[Any, ...]:
    return a.id, a.kind, a.severity.name.lower(), a.opened, a.closed, a.cause, _json(plain(a))


def _json(value: Any) -> str:
    return json.dumps(plain(value), ensure_ascii=False, separators=(",", ":"), sort_keys=True)


def _unwritable(path: Path, fault: sqlite3.Error) -> OutputError:
    return OutputError(
        f"the journal cannot be written ({fault})",
        where=str(path),
        hint="check that the folder exists, is writable and has room",
    )

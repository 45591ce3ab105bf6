"""The journal: the record of a run in SQLite files, written step by step.

Write-ahead logging makes each step atomic: after a crash the journal has every step up to the last committed
one, and it can be read while the run goes on. Events and alerts must also survive a loss of power: a step
with any is on disk, with all before it, once it is recorded; others follow with the next. Long runs continue
in further files (segments). Observations are stored in full, so that the reasoning of a run can be replayed
without its video. Read next: `journal_reader.py`, which reads journals.
"""

from __future__ import annotations

import json
import re
import sqlite3
import zlib
from contextlib import closing, suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from pydantic_core import to_json

from visup.agent.model.errors import OutputError
from visup.agent.model.events import Alert, Event
from visup.agent.model.records import Frame
from visup.agent.model.step import Step
from visup.agent.model.task_beliefs import TaskBelief
from visup.agent.storage.atomic import sync
from visup.agent.storage.codec import pack_observation
from visup.agent.storage.disk_reserve import PageReserve
from visup.agent.storage.file_lock import acquire_lock
from visup.agent.storage.jsonable import event_record, object_summary, to_jsonable

APPLICATION_ID = 0x56495355  # "VISU"
VERSION = 2

SCHEMA = """
CREATE TABLE run (key TEXT PRIMARY KEY, value TEXT NOT NULL) WITHOUT ROWID;
CREATE TABLE steps (
    frame_index INTEGER PRIMARY KEY, time REAL NOT NULL, summary TEXT NOT NULL,
    seen BLOB NOT NULL, crc INTEGER NOT NULL);
CREATE TABLE events (
    number INTEGER PRIMARY KEY, frame_index INTEGER NOT NULL, time REAL NOT NULL,
    kind TEXT NOT NULL, text TEXT NOT NULL, record TEXT NOT NULL);
CREATE TABLE alerts (
    id INTEGER PRIMARY KEY, kind TEXT NOT NULL, severity TEXT NOT NULL, opened REAL NOT NULL,
    closed REAL, cause TEXT NOT NULL, record TEXT NOT NULL);
CREATE INDEX events_by_time ON events (time);
"""

PAGE_BYTES = 16384
_FILL = "INSERT INTO run VALUES ('reserve', zeroblob(?))"
_CLEAR = "DELETE FROM run WHERE key = 'reserve'"

Statement = tuple[str, tuple[Any, ...]]


@dataclass(frozen=True, slots=True)
class JournalLimits:
    """How a journal is split into segments, and how much of it is retained.

    Attributes:
        segment_bytes: Size of the steps of a segment after which a new one begins.
        segment_s: Duration of a segment after which a new one begins, seconds of the source.
        keep_bytes: When the steps of all segments exceed this, those of the oldest are dropped; their events
            and alerts stay. None keeps everything.
        reserve_bytes: Reserved for a full disk, in the file and in its log, until the journal is closed.
    """

    segment_bytes: int = 256 * 2**20
    segment_s: float = 6 * 3600.0
    keep_bytes: int | None = None
    reserve_bytes: int = 0


class Journal:
    """Writes a run: add its `record` to an agent as an observer, and close it at the end.

    Args:
        path: The first file; it must not exist yet, unless `resume`.
        limits: When to begin a new segment, and how much to retain.
        resume: Whether to continue an existing journal.

    Attributes:
        path: As given.
        last_frame: Number of the last recorded frame, or None.

    Raises:
        OutputError: It cannot be written, another process is writing it, or the one to continue has another
            version.
    """

    def __init__(
        self, path: Path, limits: JournalLimits | None = None, *, resume: bool = False
    ) -> None:
        self.path = path
        self.last_frame: int | None = None
        self._limits = limits or JournalLimits()
        self._segment_begin: float | None = None
        self._last_event = 0
        self._sizes: list[int] = []
        self._reserve = PageReserve(self._limits.reserve_bytes, _FILL, _CLEAR)
        self._lock = acquire_lock(path, "this run")
        try:
            if resume:
                self._resume()
            else:
                self._begin()
        except BaseException:
            self._lock.release()
            raise

    @property
    def size(self) -> int:
        """Size of the retained steps, bytes."""
        return sum(self._sizes)

    def note(self, **facts: Any) -> None:
        """Store facts about the run (settings, source, verdict, ...) durably, replacing older ones."""
        rows = [(key, _text(to_jsonable(value))) for key, value in facts.items()]
        sql = "INSERT OR REPLACE INTO run VALUES (?, ?)"
        self._write([(sql, row) for row in rows], durable=True)

    def record(self, step: Step, frame: Frame | None = None) -> None:
        """Write one step atomically.

        Raises:
            OutputError: The disk is full or the file has become unwritable; earlier steps stay.
        """
        observation = pack_observation(step.observation)
        text = to_json(summary(step)).decode()
        row = (step.frame_index, step.time, text, observation, zlib.crc32(observation))
        statements: list[Statement] = [("INSERT INTO steps VALUES (?, ?, ?, ?, ?)", row)]
        statements += [
            ("INSERT INTO events VALUES (?, ?, ?, ?, ?, ?)", (number, *_event_row(e)))
            for number, e in enumerate(step.events, self._last_event + 1)
        ]
        statements += [
            ("INSERT OR REPLACE INTO alerts VALUES (?, ?, ?, ?, ?, ?, ?)", _alert_row(a))
            for a in step.alerts
        ]
        if self._is_full(step.time):
            self._next_segment()
        self._write(statements, durable=bool(step.events or step.alerts))
        self._last_event += len(step.events)
        self.last_frame = step.frame_index
        self._segment_begin = step.time if self._segment_begin is None else self._segment_begin
        self._sizes[-1] += len(observation) + len(text)
        self._reserve.keep(self._db)

    def close(self) -> None:
        """Merge the log into the file and close it."""
        try:
            with suppress(
                sqlite3.Error
            ):  # pages that cannot be released now stay free for later use
                self._db.executescript("PRAGMA incremental_vacuum")
            self._db.execute("PRAGMA wal_checkpoint(TRUNCATE)")
            self._db.close()
        except sqlite3.Error as fault:
            raise _unwritable(self.path, fault) from fault
        finally:
            self._lock.release()

    def _begin(self) -> None:
        if self.path.is_file() and self.path.stat().st_size:
            raise OutputError(
                "a run is already recorded here",
                where=str(self.path),
                hint="choose another folder, or delete this one",
            )
        self._open(self.path, 1)

    def _open(self, path: Path, number: int) -> None:
        if path.is_symlink():  # a dangling link: the file would be created elsewhere
            raise OutputError("the journal would be written elsewhere", where=str(path))
        try:
            self._db = _connected(path, self._limits.reserve_bytes)
            self._durable = False
            # One transaction: a run killed meanwhile leaves an empty file or a complete journal.
            marks = f"PRAGMA application_id={APPLICATION_ID};PRAGMA user_version={VERSION};"
            self._db.executescript(f"BEGIN;{SCHEMA}{marks}COMMIT;")
            self._reserve.keep(self._db)
            sync(path.parent)
        except (sqlite3.Error, OSError) as fault:
            raise _unwritable(path, fault) from fault
        self._sizes.append(0)
        self._segment_begin = None
        if number > 1:
            self.note(segment=number)

    def _resume(self) -> None:
        # The last one stays open: closing it would remove the log, and with it the reserve.
        *earlier, self._db = filter(None, map(self._reopened, segments(self.path)))
        for db in earlier:
            db.close()
        self._durable = False
        self._reserve.keep(self._db)

    def _reopened(self, path: Path) -> sqlite3.Connection | None:
        """Open a segment and count its content; None if the run was killed before it was begun."""
        try:
            db = _connected(path, self._limits.reserve_bytes)
            if path != self.path and is_empty(db):
                db.close()
                return None
            check_version(db, path)
            last, begin, size = db.execute(
                "SELECT max(frame_index), min(time), coalesce(sum(length(seen) + length(summary)), 0)"
                " FROM steps"
            ).fetchone()
            (event,) = db.execute("SELECT coalesce(max(number), 0) FROM events").fetchone()
        except sqlite3.Error as fault:
            raise _unwritable(path, fault) from fault
        self.last_frame = last if last is not None else self.last_frame
        self._last_event = max(self._last_event, event)
        self._segment_begin = begin
        self._sizes.append(size)
        return db

    def _is_full(self, time: float) -> bool:
        if self._segment_begin is None:
            return False
        limits = self._limits
        duration = time - self._segment_begin
        return self._sizes[-1] >= limits.segment_bytes or duration >= limits.segment_s

    def _next_segment(self) -> None:
        number = len(self._sizes) + 1
        old = self._db
        self._open(segment_path(self.path, number), number)
        try:
            old.execute("PRAGMA wal_checkpoint(TRUNCATE)")
            old.close()
            self._drop_oldest_steps()
        except sqlite3.Error as fault:
            raise _unwritable(self.path, fault) from fault

    def _drop_oldest_steps(self) -> None:
        """Drop the steps of the oldest segments beyond `keep_bytes`."""
        keep = self._limits.keep_bytes
        for i in range(len(self._sizes) - 1):
            if keep is None or sum(self._sizes) + self._limits.segment_bytes <= keep:
                return
            if self._sizes[i]:
                db = _connected(segment_path(self.path, i + 1))
                db.execute("DELETE FROM steps")
                db.execute("INSERT OR REPLACE INTO run VALUES ('steps_dropped', 'true')")
                db.execute("VACUUM")
                db.execute("PRAGMA wal_checkpoint(TRUNCATE)")
                db.close()
                self._sizes[i] = 0

    def _write(self, statements: list[Statement], *, durable: bool) -> None:
        try:
            if durable != self._durable:
                self._db.execute(f"PRAGMA synchronous={'FULL' if durable else 'NORMAL'}")
                self._durable = durable
            if len(statements) == 1:  # a transaction by itself
                self._db.execute(*statements[0])
                return
            self._db.execute("BEGIN IMMEDIATE")
            for sql, row in statements:
                self._db.execute(sql, row)
            self._db.execute("COMMIT")
        except sqlite3.Error as fault:
            if self._db.in_transaction:
                self._db.execute("ROLLBACK")
            raise _unwritable(self.path, fault) from fault


def segment_path(path: Path, number: int) -> Path:
    """The file of a segment: `journal.sqlite`, `journal-2.sqlite`, ..."""
    return path if number == 1 else path.with_name(f"{path.stem}-{number}{path.suffix}")


def segments(path: Path) -> list[Path]:
    """The files of a journal in order, always including the first."""
    found = [path]
    while (following := segment_path(path, len(found) + 1)).is_file():
        found.append(following)
    return found


def is_empty(db: sqlite3.Connection) -> bool:
    """Whether a file is an empty segment."""
    return db.execute("SELECT 1 FROM sqlite_schema LIMIT 1").fetchone() is None


def check_schema(db: sqlite3.Connection, path: Path) -> None:
    """Refuse a file without exactly the tables of a journal, before reading any of them.

    A view in place of a table may run an endless query.

    Raises:
        OutputError: It is none.
    """
    db.execute("PRAGMA trusted_schema = OFF")
    if sorted(db.execute(_SCHEMA_QUERY)) != _expected_schema():
        raise OutputError("this is not a journal", where=str(path), expected="a run of visup")


_SCHEMA_QUERY = "SELECT type, name, tbl_name, sql FROM sqlite_schema"


@cache
def _expected_schema() -> list[Any]:
    with closing(sqlite3.connect(":memory:")) as db:
        db.executescript(SCHEMA)
        return sorted(db.execute(_SCHEMA_QUERY))


def check_version(db: sqlite3.Connection, path: Path) -> None:
    """Refuse a file that is not a journal of this version.

    Raises:
        OutputError: It is none.
    """
    (application,) = db.execute("PRAGMA application_id").fetchone()
    (version,) = db.execute("PRAGMA user_version").fetchone()
    if application != APPLICATION_ID:
        raise OutputError("this is not a journal", where=str(path), expected="a run of visup")
    if version != VERSION:
        raise OutputError(
            f"this journal has version {version}",
            where=str(path),
            expected=f"version {VERSION}",
            hint="record the run again with this visup, or read it with the visup that wrote it",
        )
    check_schema(db, path)


def summary(step: Step) -> dict[str, Any]:
    """A summary of the beliefs after a step; everything else follows from the observation (`seen`)."""
    mind = step.mind
    return {
        "objects": [object_summary(b) for _, b in sorted(mind.objects.items())],
        "couplings": to_jsonable(mind.couplings),
        "tasks": [_task_summary(t) for t in mind.tasks],
        "health": to_jsonable(mind.health),
        "unknown": to_jsonable(mind.unknown),
        "directives": to_jsonable(step.directives),
        "behaviours": {r.behaviour: [r.state.value, r.error] for r in step.reports},
    }


def _task_summary(task: TaskBelief) -> dict[str, Any]:
    return {
        "task": task.task,
        "verdict": task.verdict.value,
        "current": task.current,
        "stages": {s.stage: s.status.value for s in task.stages},
        "sure": {s.stage: round(s.confidence, 3) for s in task.stages if s.confidence < 1.0},
        "next": [[p.stage, round(p.probability, 3)] for p in task.prospects],
        "success": None if task.success is None else round(task.success, 3),
    }


def _connected(path: Path, reserve_bytes: int = 0) -> sqlite3.Connection:
    # Written by one thread at a time, which the caller ensures.
    db = sqlite3.connect(path, isolation_level=None, check_same_thread=False)
    # Large pages suit steps of a few kilobytes; an existing file keeps its page size.
    db.execute(f"PRAGMA page_size={PAGE_BYTES}")
    if reserve_bytes:  # free pages can be released, and the log is as long as they are
        db.execute("PRAGMA auto_vacuum=INCREMENTAL")
        db.execute(f"PRAGMA wal_autocheckpoint={reserve_bytes // PAGE_BYTES}")
    db.execute("PRAGMA journal_mode=WAL")
    db.execute("PRAGMA synchronous=NORMAL")
    return db


def _event_row(event: Event) -> tuple[Any, ...]:
    return event.frame_index, event.time, event.kind, event.text, _text(event_record(event))


def _alert_row(a: Alert) -> tuple[Any, ...]:
    return a.id, a.kind, a.severity.name.lower(), a.opened, a.closed, a.cause, _text(to_jsonable(a))


def _text(value: Any) -> str:
    """Plain values as canonical JSON.

    File names that are not UTF-8 contain surrogates, which are written as escapes.
    """
    return _SURROGATE.sub(lambda found: f"\\u{ord(found[0]):04x}", _TEXT.encode(value))


_SURROGATE = re.compile("[\ud800-\udfff]")


_TEXT = json.JSONEncoder(ensure_ascii=False, separators=(",", ":"), sort_keys=True)


def _unwritable(path: Path, fault: sqlite3.Error | OSError) -> OutputError:
    return OutputError(
        f"the journal cannot be written ({fault})",
        where=str(path),
        hint="check that the folder exists, is writable and has room",
    )

"""Reads a recorded run: its facts, steps, events and alerts, over all segments of its journal."""

from __future__ import annotations

import json
import math
import sqlite3
import zlib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from visup.agent.contract.percept_values import LARGEST_SIDE, check_value, expect, is_finite
from visup.agent.model.did_you_mean import closest_file
from visup.agent.model.errors import BehaviourError, OutputError
from visup.agent.model.records import Observation
from visup.agent.storage.atomic import replacing
from visup.agent.storage.codec import LARGEST_STEP_BYTES, unpack_observation
from visup.agent.storage.journal import check_version, is_empty, segments
from visup.agent.storage.text_file import check_room
from visup.agent.storage.wall_clock import RecordStamp, WallClock

JOURNAL = "journal.sqlite"
_LARGEST_ROW = LARGEST_STEP_BYTES
_LARGEST_RECORD = 16 * 2**20
"""Maximum characters of a record other than a step."""


def _similar_run_hint(run: Path) -> str | None:
    """A hint with a run of a similar name in the same folder, or None."""
    try:
        runs = [p.name for p in run.parent.iterdir() if (p / JOURNAL).is_file()]
    except OSError:
        return None
    nearest = closest_file(run, runs)
    return f"did you mean {nearest}?" if nearest and nearest != run else None


@dataclass(frozen=True, slots=True)
class Recording:
    """A run on disk, possibly live. Data are read on demand.

    Attributes:
        path: The first file of its journal.
    """

    path: Path

    @classmethod
    def open(cls, run: Path) -> Recording:
        """The recording of a run.

        Args:
            run: A run folder, or the journal in it.

        Raises:
            OutputError: There is none, or it is of another version.
        """
        path = run / JOURNAL if run.is_dir() else run
        if not path.is_file():
            raise OutputError(
                "there is no recorded run here",
                where=str(run),
                expected=f"a run folder with {JOURNAL}",
                hint=_similar_run_hint(run),
            )
        recording = cls(path)
        for _ in recording._rows("SELECT 1 FROM steps, run LIMIT 1"):
            pass
        return recording

    def facts(self) -> Mapping[str, Any]:
        """Facts about the run, from `Journal.note`."""
        rows = self._rows("SELECT key, value FROM run")
        return {key: self._parsed(value) for _, (key, value) in rows}

    def events(self) -> Iterator[dict[str, Any]]:
        """Events as in `events.jsonl`, in order."""
        rows = self._rows("SELECT record FROM events ORDER BY number")
        return (self._record(record) for _, (record,) in rows)

    def answers(self) -> dict[int, dict[int, str]]:
        """The operator's answers: frame index -> object id -> model name."""
        found: dict[int, dict[int, str]] = {}
        for _, (text,) in self._rows("SELECT record FROM events WHERE kind = 'answer'"):
            event = self._record(text)
            try:
                number, name = int(event["objects"][0]), str(event["data"]["name"])
                found.setdefault(int(event["frame_index"]), {})[number] = name
            except (KeyError, IndexError, TypeError, ValueError) as fault:
                raise _damaged(str(self.path), "an answer is invalid") from fault
        return found

    def alerts(self) -> dict[int, dict[str, Any]]:
        """Alerts by id in their last state."""
        rows = self._rows("SELECT record FROM alerts ORDER BY id")
        found = [self._record(record) for _, (record,) in rows]
        return {a["id"]: a for a in found if isinstance(a.get("id"), int)}

    def summaries(self, first: int = 0, last: int = 2**63 - 1) -> Iterator[dict[str, Any]]:
        """Summaries of the beliefs after each step, with frame index and time.

        Args:
            first: Number of the first frame.
            last: Number of the last frame.
        """
        sql = "SELECT frame_index, time, summary FROM steps WHERE frame_index BETWEEN ? AND ?"
        rows = self._rows(f"{sql} ORDER BY frame_index", (first, last))
        return ({"frame_index": i, "time": t, **self._record(s)} for _, (i, t, s) in rows)

    def observations(self, after: int = -1) -> Iterator[Observation]:
        """The observations, step by step.

        Args:
            after: Only frames with a higher number.

        Raises:
            OutputError: A step is damaged; those before it were yielded.
        """
        sql = "SELECT frame_index, seen, crc FROM steps WHERE frame_index > ? ORDER BY frame_index"
        for path, (index, data, crc) in self._rows(sql, (after,)):
            yield _observation_of(path, index, data, crc)

    def moments(self, after: int = -1) -> Iterator[tuple[int, float]]:
        """Number and time (seconds) of each processed frame, in order.

        Args:
            after: Only frames with a higher number.
        """
        sql = "SELECT frame_index, time FROM steps WHERE frame_index > ? ORDER BY frame_index"
        rows = self._rows(sql, (after,))
        return ((int(index), float(time)) for _, (index, time) in rows)

    def summary_at(self, frame: int) -> dict[str, Any]:
        """The summary of the beliefs after one step.

        Raises:
            OutputError: There is no such step, or it is damaged.
        """
        sql = "SELECT frame_index, time, summary FROM steps WHERE frame_index = ?"
        for _, (index, time, text) in self._rows(sql, (frame,)):
            return {"frame_index": index, "time": time, **self._record(text)}
        raise self._no_step(frame)

    def summaries_of(self, frames: Sequence[int]) -> Iterator[dict[str, Any]]:
        """Summaries of some steps, as `summary_at`; those that are damaged or missing are left out.

        Args:
            frames: Numbers of a few hundred frames at most.
        """
        placeholders = ",".join("?" * len(frames))
        sql = f"SELECT frame_index, time, summary FROM steps WHERE frame_index IN ({placeholders})"
        for _, (index, time, text) in self._rows(f"{sql} ORDER BY frame_index", tuple(frames)):
            try:
                yield {"frame_index": index, "time": time, **self._record(text)}
            except OutputError:
                continue

    def step_at(self, frame: int) -> tuple[dict[str, Any], Observation]:
        """The summary of the beliefs after one step, and its observation.

        Raises:
            OutputError: There is no such step, or it is damaged.
        """
        sql = "SELECT frame_index, time, summary, seen, crc FROM steps WHERE frame_index = ?"
        for path, (index, time, text, data, crc) in self._rows(sql, (frame,)):
            fields = {"frame_index": index, "time": time, **self._record(text)}
            return fields, _observation_of(path, index, data, crc)
        raise self._no_step(frame)

    def _no_step(self, frame: int) -> OutputError:
        return OutputError(f"frame {frame} was not processed in this run", where=str(self.path))

    def stamp(self) -> RecordStamp:
        """The common fields of a record: camera, host, wall-clock time."""
        facts = self.facts()
        stamp = RecordStamp(clock=WallClock.read(facts.get("clock")))
        stamp.named = {key: str(facts[key]) for key in ("camera", "host") if key in facts}
        return stamp

    def first_and_last(self) -> tuple[int, int] | None:
        """Numbers of the first and last frame with stored steps, or None."""
        rows = self._rows("SELECT min(frame_index), max(frame_index) FROM steps")
        ends = [(a, b) for _, (a, b) in rows if isinstance(a, int) and isinstance(b, int)]
        return (ends[0][0], ends[-1][1]) if ends else None

    def count(self) -> int:
        """Number of stored steps."""
        return sum(n for _, (n,) in self._rows("SELECT count(*) FROM steps"))

    def written(self) -> float:
        """When it was last written to, seconds since the epoch."""
        last = segments(self.path)[-1]
        wal = last.with_name(last.name + "-wal")
        return max(p.stat().st_mtime for p in (last, wal) if p.exists())

    def _rows(
        self, sql: str, parameters: tuple[Any, ...] = ()
    ) -> Iterator[tuple[Path, tuple[Any, ...]]]:
        for path in segments(self.path):
            try:
                with closing(opened_readonly(path)) as db:
                    if path != self.path and is_empty(db):
                        continue
                    check_version(db, path)
                    for row in db.execute(sql, parameters):
                        yield path, row
            except (sqlite3.Error, ValueError, TypeError, OverflowError) as fault:
                raise _unreadable(path, fault) from fault

    def _record(self, text: Any) -> dict[str, Any]:
        loaded = self._parsed(text)
        if not isinstance(loaded, dict):
            raise _damaged(str(self.path), "a record is not a JSON object")
        return loaded

    def _parsed(self, text: Any) -> Any:
        try:
            if not isinstance(text, str) or len(text) > _LARGEST_RECORD:
                raise ValueError(f"a record is no text, or longer than {_LARGEST_RECORD >> 20} MB")
            check_room(text.encode(errors="replace"))
            return json.loads(text)
        except (ValueError, TypeError, RecursionError) as fault:
            raise _damaged(str(self.path), str(fault)) from fault


def _observation_of(path: Path, index: int, data: Any, crc: Any) -> Observation:
    """The observation of a step from its row in the journal."""
    where = f"{path}, frame {index}"
    if not isinstance(data, bytes) or zlib.crc32(data) != crc:
        raise _damaged(where, "its check sum is wrong")
    return checked(unpack_observation(data, where), where)


def checked(observation: Observation, where: str) -> Observation:
    """The same observation after validating its percepts.

    Raises:
        OutputError: One is not valid.
    """
    size = observation.frame_size
    try:
        valid = math.isfinite(observation.time) and all(0 < side <= LARGEST_SIDE for side in size)
        expect(valid, f"a frame of {size[0]}x{size[1]} pixels at {observation.time} s", "a frame")
        for report in observation.reports:
            for p in report.percepts:
                valid = is_finite(p.time) and is_finite(p.confidence) and 0 <= p.confidence <= 1
                expect(valid, f"'{p.kind}' has no time or confidence", "numbers")
                check_value(p.kind, p.value, size, f"'{p.kind}'")
    except (BehaviourError, TypeError, ValueError, AttributeError, OverflowError) as fault:
        raise _damaged(where, str(fault)[:LONGEST_ERROR_TEXT]) from fault
    return observation


LONGEST_ERROR_TEXT = 300


def is_run(place: str | Path) -> bool:
    """Whether a path is a recorded run: its folder, or its journal."""
    path = Path(place)
    return (path / JOURNAL).is_file() or (path.is_file() and path.name == JOURNAL)


def export_events(journal: Path, target: Path) -> None:
    """Write `events.jsonl` from a journal: one event per line, with camera, host and time if known.

    Raises:
        OutputError: `target` cannot be written, or `journal` cannot be read.
    """
    try:
        with replacing(target) as draft, draft.open("w", encoding="utf-8") as out:
            recording = Recording.open(journal)
            stamp = recording.stamp()
            for event in recording.events():
                out.write(event_text({**event, **stamp.of(_time_of(event))}) + "\n")
    except OSError as fault:
        raise OutputError(f"cannot write: {fault.strerror}", where=str(target)) from fault


def _time_of(event: Mapping[str, Any]) -> float:
    time = event.get("time")
    return float(time) if isinstance(time, int | float) and math.isfinite(time) else 0.0


def event_text(event: Mapping[str, Any]) -> str:
    """An event as a line of `events.jsonl`, without the newline."""
    return json.dumps(event, ensure_ascii=False, separators=(",", ":"), sort_keys=True)


def opened_readonly(path: Path) -> sqlite3.Connection:
    """Open the file read-only, even where its log must not be touched.

    An unfinished reader may be closed by the thread that collects it as garbage.
    """
    uri = path.absolute().as_uri()
    db = sqlite3.connect(f"{uri}?mode=ro", uri=True, check_same_thread=False)
    try:
        db.execute("SELECT 1 FROM sqlite_schema").fetchone()
    except sqlite3.OperationalError:
        db.close()
        db = sqlite3.connect(f"{uri}?mode=ro&immutable=1", uri=True, check_same_thread=False)
    db.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, _LARGEST_ROW)
    return db


def _unreadable(path: Path, fault: Exception) -> OutputError:
    """The error for an unreadable journal: missing permission is no damage."""
    try:
        with path.open("rb"):
            pass
    except OSError as error:
        reason = error.strerror or str(error)
        return OutputError(
            f"the journal cannot be read ({reason})",
            where=str(path),
            hint="check the permissions of the file and its folder",
        )
    return _damaged(str(path), str(fault))


def _damaged(where: str, what: str) -> OutputError:
    return OutputError(f"this is not a journal, or it is damaged ({what})", where=where)

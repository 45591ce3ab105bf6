"""The database file: how it is written whole, and what is refused on reading.

One SQLite file. What is needed of every view (its model, direction, root and sketch) stands in a few
blocks, so that opening a hundred thousand views reads some megabytes; each shape stands in a row of its
own and is read when it is asked for. All bytes have a check sum: what is read is what was written.

Read next: `catalogue.py`, which is what the rest of the code sees of a file.
"""

from __future__ import annotations

import os
import shutil
import sqlite3
import tempfile
import zlib
from collections.abc import Iterable, Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import numpy as np

from visup.agent.model.errors import DatabaseError
from visup.percepts.shape.index.outline_sketch import sketch
from visup.percepts.shape.index.view_records import (
    ALSO,
    LAYOUT,
    POINT,
    VIEW,
    InvalidRecordError,
    NewView,
    Records,
    ShapeBytes,
    check_nodes,
    encode,
    node_records,
    records,
)
from visup.percepts.shape.silhouette.height_functions import outline_heights

APPLICATION_ID = 0x76697375
"""'visu' in ASCII, in the header of every database file."""

VERSION = 2
"""Version of the tables; a newer file is refused, since its meaning is not known."""

BLOCK = 1024
"""Views of a block at most."""

MOST_NAME = 200
"""Characters of a model's name at most."""

_TABLES = (
    "CREATE TABLE layout (part TEXT PRIMARY KEY, meaning TEXT NOT NULL)",
    "CREATE TABLE models (code INTEGER PRIMARY KEY, name TEXT NOT NULL, crc INTEGER NOT NULL)",
    "CREATE TABLE blocks (number INTEGER PRIMARY KEY, views BLOB NOT NULL, also BLOB NOT NULL, "
    "crc INTEGER NOT NULL)",
    "CREATE TABLE shapes (view INTEGER PRIMARY KEY, nodes BLOB NOT NULL, edges BLOB NOT NULL, "
    "contour BLOB NOT NULL, crc INTEGER NOT NULL)",
)
_MOST_BYTES = 1 << 24
# Messages about damaged tables quote them, and are no text when what they quote is none.
_UNREADABLE = (sqlite3.Error, UnicodeDecodeError)
_BUILD_HINT = "build it anew with 'visup models build'"


@dataclass(frozen=True, slots=True, eq=False)
class FileContents:
    """All that stands in a file but the shapes.

    Attributes:
        names: Names of the models, in the order of the file.
        views: (V,) records of `VIEW`.
        also: (A,) records of `ALSO`, rising by view (from 0).
    """

    names: tuple[str, ...]
    views: Records
    also: Records


def write_new(path: Path, views: Iterable[NewView]) -> None:
    """Write a database with these views, in place of whatever stands at the path.

    Raises:
        DatabaseError: The file cannot be written; nothing is left behind.
    """
    with _replacing(path) as temporary, closing(sqlite3.connect(temporary)) as file:
        file.execute("PRAGMA page_size = 8192")
        file.execute(f"PRAGMA application_id = {APPLICATION_ID}")
        file.execute(f"PRAGMA user_version = {VERSION}")
        for table in _TABLES:
            file.execute(table)
        file.executemany("INSERT INTO layout VALUES (?, ?)", LAYOUT.items())
        _insert(file, FileContents((), np.empty(0, VIEW), np.empty(0, ALSO)), views)


def write_more(path: Path, views: Iterable[NewView]) -> None:
    """Add views to a database; the file is replaced whole, or left as it was.

    Raises:
        DatabaseError: The file is no database of this version, or cannot be written.
    """
    before = read_contents(path)
    with _replacing(path) as temporary:
        shutil.copyfile(path, temporary)
        with closing(sqlite3.connect(temporary)) as file:
            _insert(file, before, views)


@contextmanager
def _replacing(path: Path) -> Iterator[Path]:
    """A temporary file beside the path that takes its place when all went well."""
    try:
        handle, name = tempfile.mkstemp(prefix=f".{path.name}.", suffix=".part", dir=path.parent)
    except OSError as e:
        raise DatabaseError(
            f"the database cannot be written ({e.strerror})",
            where=str(path),
            expected="a folder that exists and can be written to",
        ) from e
    os.close(handle)
    temporary = Path(name)
    try:
        yield temporary
        temporary.chmod(0o644)
        temporary.replace(path)
    except (OSError, sqlite3.Error) as e:
        raise DatabaseError(f"the database cannot be written ({e})", where=str(path)) from e
    finally:
        temporary.unlink(missing_ok=True)


def _insert(file: sqlite3.Connection, before: FileContents, views: Iterable[NewView]) -> None:
    """Append views in blocks; models new to the file get the next codes."""
    codes = {name: code for code, name in enumerate(before.names)}
    numbers = dict(enumerate(np.bincount(before.views["model"], minlength=len(codes)).tolist()))
    (blocks,) = file.execute("SELECT coalesce(max(number), -1) + 1 FROM blocks").fetchone()
    start, coming = len(before.views), iter(views)
    with file:
        while new := list(islice(coming, BLOCK)):
            for view in new:
                if view.name not in codes:
                    codes[view.name] = code = len(codes)
                    known = (code, view.name, _sum(code, view.name.encode()))
                    file.execute("INSERT INTO models VALUES (?, ?, ?)", known)
            rows, also = _block(new, start, codes, numbers)
            data = (rows.tobytes(), also.tobytes())
            row = (blocks, *data, _sum(blocks, *data))
            file.execute("INSERT INTO blocks VALUES (?, ?, ?, ?)", row)
            file.executemany("INSERT INTO shapes VALUES (?, ?, ?, ?, ?)", _shape_rows(new, start))
            start, blocks = start + len(new), blocks + 1


def _block(
    new: list[NewView], start: int, codes: dict[str, int], numbers: dict[int, int]
) -> tuple[Records, Records]:
    """The records of some views; `numbers` counts the views of each model."""
    rows = np.zeros(len(new), dtype=VIEW)
    also = []
    for k, view in enumerate(new):
        code = codes[view.name]
        rows[k]["model"], rows[k]["number"] = code, numbers.get(code, 0)
        numbers[code] = numbers.get(code, 0) + 1
        rows[k]["direction"] = view.direction or (np.nan, np.nan, np.nan)
        rows[k]["area"] = np.nan if view.area is None else view.area
        rows[k]["smoothing"], rows[k]["cut"] = view.smoothing, view.shape.cut
        rows[k]["border"] = np.nan if view.shape.border is None else view.shape.border
        rows[k]["areas"] = view.shape.areas
        rows[k]["root"] = node_records(view.shape.graph)[0]
        # Of the outline as it will be read, so that it does not matter where a view comes from.
        rows[k]["sketch"] = sketch(outline_heights(np.asarray(view.shape.contour, POINT.base)))
        also += [(start + k, d) for d in view.also]
    return rows, np.array(also, dtype=ALSO)


def _shape_rows(new: list[NewView], start: int) -> Iterator[tuple[int, bytes, bytes, bytes, int]]:
    for k, view in enumerate(new):
        data = encode(view.shape)
        parts = (data.nodes, data.edges, data.contour)
        yield start + k, *parts, _sum(start + k, *parts)


def _sum(number: int, *parts: bytes) -> int:
    """Check sum of a row; its number is in it, so that rows cannot change places."""
    total = number
    for part in parts:
        total = zlib.crc32(part, total)
    return total


def open_checked(path: Path) -> sqlite3.Connection:
    """Open a database for reading, after checking that it is one.

    Raises:
        DatabaseError: Missing, not a database, truncated, or of another version or layout.
    """
    if not path.is_file():
        raise DatabaseError(
            "there is no such model database",
            where=str(path),
            expected="a file made by 'visup models build'",
            hint=_BUILD_HINT,
        )
    _check_header(path)
    try:
        file = sqlite3.connect(
            f"{path.resolve().as_uri()}?mode=ro&immutable=1", uri=True, check_same_thread=False
        )
    except sqlite3.Error as e:
        raise _unreadable(path, e) from e
    try:
        _check_tables(path, file)
    except BaseException as e:
        file.close()
        if isinstance(e, _UNREADABLE):
            raise _unreadable(path, e) from e
        raise
    return file


def _check_header(path: Path) -> None:
    """Look at the first 100 bytes, as SQLite's file format defines them, before SQLite does."""
    try:
        with path.open("rb") as file:
            header = file.read(100)
    except OSError as e:
        raise _unreadable(path, e) from e
    if len(header) < 100 or not header.startswith(b"SQLite format 3\0"):
        raise _unreadable(path, "no SQLite header")
    page, pages, version, application = (
        int.from_bytes(header[a:b], "big") for a, b in ((16, 18), (28, 32), (60, 64), (68, 72))
    )
    if application != APPLICATION_ID:
        raise DatabaseError(
            f"this is not a model database (application id {application:#x})",
            where=str(path),
            expected=f"application id {APPLICATION_ID:#x}",
            hint=_BUILD_HINT,
        )
    if version != VERSION:
        raise DatabaseError(
            f"this model database is of version {version}",
            where=str(path),
            expected=f"version {VERSION}",
            hint="use a newer visup for it" if version > VERSION else _BUILD_HINT,
        )
    # A page size of 65536 does not fit its field and is written as 1.
    expected, found = pages * (65536 if page == 1 else page), path.stat().st_size
    if found < expected:
        raise DatabaseError(
            f"this model database is truncated: {found} bytes",
            where=str(path),
            expected=f"{expected} bytes",
            hint=_BUILD_HINT,
        )


def _check_tables(path: Path, file: sqlite3.Connection) -> None:
    """Only tables as we write them: a view or a trigger of a foreign file could compute for ever."""
    file.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, _MOST_BYTES)
    file.execute("PRAGMA trusted_schema = OFF")
    file.execute("PRAGMA cell_size_check = ON")
    query = "SELECT sql FROM sqlite_master WHERE sql IS NOT NULL LIMIT 50"
    found = sorted(str(sql) for (sql,) in file.execute(query))
    if found != sorted(_TABLES):
        raise damaged(path, "its tables are not those of a model database", "; ".join(_TABLES))
    layout = dict(file.execute("SELECT part, meaning FROM layout LIMIT 50").fetchall())
    if layout != LAYOUT:
        raise DatabaseError(
            "this model database is of another layout",
            where=str(path),
            expected=str(LAYOUT),
            hint=_BUILD_HINT,
        )


def read_contents(path: Path) -> FileContents:
    """All that stands in a database but the shapes.

    Raises:
        DatabaseError: As `open_checked`; or what stands there is not as it should be.
    """
    with closing(open_checked(path)) as file:
        try:
            names = _read_names(file)
            views, also = _read_blocks(file)
            _check_views(views, also, len(names))
            (last,) = file.execute("SELECT max(view) FROM shapes").fetchone()
            if (-1 if last is None else last) != len(views) - 1:
                raise InvalidRecordError("other views than shapes")
        except InvalidRecordError as e:
            raise damaged(path, str(e), "what 'visup models' writes") from e
        except _UNREADABLE as e:
            raise _unreadable(path, e) from e
    return FileContents(names, views, also)


def _read_names(file: sqlite3.Connection) -> tuple[str, ...]:
    names: list[str] = []
    for code, name, crc in file.execute("SELECT code, name, crc FROM models ORDER BY code"):
        # A damaged tree may lead round in circles: codes that do not count up end the reading.
        if code != len(names) or not isinstance(name, str) or not 0 < len(name) <= MOST_NAME:
            raise InvalidRecordError(f"model {len(names)} without a name")
        if crc != _sum(code, name.encode()):
            raise InvalidRecordError(f"a wrong check sum of model {code}")
        names.append(name)
    if len(set(names)) < len(names):
        raise InvalidRecordError("two models of one name")
    return tuple(names)


def _read_blocks(file: sqlite3.Connection) -> tuple[Records, Records]:
    views, also = [np.empty(0, VIEW)], [np.empty(0, ALSO)]
    query = "SELECT number, views, also, crc FROM blocks ORDER BY number"
    for expected, (number, data, further, crc) in enumerate(file.execute(query)):
        if number != expected:
            raise InvalidRecordError(f"block {expected} is missing")
        rows = records(data, VIEW, 1, BLOCK, f"views in block {number}")
        others = records(further, ALSO, 0, BLOCK * 10_000, f"directions in block {number}")
        if crc != _sum(number, data, further):
            raise InvalidRecordError(f"a wrong check sum of block {number}")
        views.append(rows)
        also.append(others)
    return np.concatenate(views), np.concatenate(also)


def _check_views(views: Records, also: Records, models: int) -> None:
    """Refuse views that cannot be, whoever has computed their check sums.

    Raises:
        NotAsExpectedError: There are some.
    """
    used = np.unique(views["model"])
    if len(used) and int(used[-1]) >= models:
        raise InvalidRecordError("a view of no model")
    if len(used) < models:
        raise InvalidRecordError("a model without views")
    expected = _numbers_within(views["model"])
    if not np.array_equal(views["number"], expected):
        raise InvalidRecordError("views that are not numbered")
    directions = np.concatenate([views["direction"], also["direction"]])
    length = np.linalg.norm(directions, axis=1)
    unknown = np.isnan(directions).all(axis=1)
    unknown[len(views) :] = False
    area, smoothing = views["area"], views["smoothing"]
    for sound, what in (
        (unknown | (np.abs(length - 1) < 1e-3), "a direction that is no unit vector"),
        (np.isnan(area) | ((area > 0) & np.isfinite(area)), "an area that cannot be"),
        ((smoothing >= 0) & (smoothing < 1), "a smoothing that cannot be"),
        (views["cut"] <= 1, "a mark of a cut that is none"),
        (np.isnan(views["border"]) | (np.abs(views["border"]) < 4), "a border that is nowhere"),
        (also["view"] < len(views), "a direction of no view"),
        (np.diff(also["view"].astype(np.int64)) >= 0, "directions in disorder"),
    ):
        if not bool(sound.all()):
            raise InvalidRecordError(what)
    check_nodes(views["root"])


def _numbers_within(models: Records) -> Records:
    """For each view how many views of its model come before it."""
    order = np.argsort(models, kind="stable")
    counts = np.bincount(models.astype(np.intp)) if len(models) else np.empty(0, np.intp)
    out = np.empty(len(models), dtype=np.intp)
    out[order] = np.arange(len(models)) - np.repeat(np.cumsum(counts) - counts, counts)
    return out


def read_shape(path: Path, file: sqlite3.Connection, view: int) -> ShapeBytes:
    """The bytes of one shape.

    Args:
        path: The file, for messages.
        file: From `open_checked`.
        view: Number of the view in the file, from 0.

    Raises:
        DatabaseError: They are not there, or not those that were written.
    """
    query = "SELECT nodes, edges, contour, crc FROM shapes WHERE view = ?"
    try:
        row = file.execute(query, (view,)).fetchone()
    except _UNREADABLE as e:
        raise _unreadable(path, e) from e
    if row is None:
        raise damaged(path, f"view {view + 1} without a shape", "a shape for each view")
    *parts, crc = row
    if not all(isinstance(p, bytes) for p in parts) or crc != _sum(view, *parts):
        raise damaged(
            path, f"a wrong check sum of the shape of view {view + 1}", "what was written"
        )
    return ShapeBytes(*parts)


def damaged(path: Path, found: str, expected: str) -> DatabaseError:
    """The error of a file that is a database, but not a sound one."""
    return DatabaseError(
        f"this model database is damaged: {found}",
        where=str(path),
        expected=expected,
        hint=_BUILD_HINT,
    )


def _unreadable(path: Path, error: object) -> DatabaseError:
    return DatabaseError(
        f"this is not a model database that can be read ({error})",
        where=str(path),
        expected="a file made by 'visup models build'",
        hint=_BUILD_HINT,
    )

"""Reading and validating a database file.

A file may come from anybody: its header, tables, layout, check sums and values are checked before any of it
is used.
"""

from __future__ import annotations

import sqlite3
from contextlib import closing
from pathlib import Path

import numpy as np

from visup.agent.model.errors import DatabaseError
from visup.percepts.shape.database.file_format import (
    APPLICATION_ID,
    BUILD_HINT,
    LARGEST_ROW_BYTES,
    LONGEST_NAME,
    OLDEST_VERSION,
    TABLES_OF_VERSION,
    UNREADABLE,
    VERSION,
    VIEWS_PER_BLOCK,
    FileContents,
    checksum,
    damaged,
    unreadable,
)
from visup.percepts.shape.database.mesh_records import read_meshes
from visup.percepts.shape.database.taught_records import read_taught
from visup.percepts.shape.index.view_records import (
    ALSO,
    LAYOUT,
    VIEW,
    InvalidRecordError,
    Records,
    ShapeBytes,
    check_nodes,
    records,
)


def open_checked(path: Path) -> sqlite3.Connection:
    """Open a database for reading, after checking that it is one.

    Raises:
        DatabaseError: Missing, not a database, truncated, or of another version or layout.
    """
    if not path.is_file():
        raise DatabaseError(
            "there is no such model database",
            where=str(path),
            expected="a file made by 'visup teach' or 'visup models build'",
            hint="outline things in a clip of yours: visup teach CLIP --models DB",
        )
    _check_header(path)
    try:
        file = sqlite3.connect(
            f"{path.resolve().as_uri()}?mode=ro&immutable=1", uri=True, check_same_thread=False
        )
    except sqlite3.Error as e:
        raise unreadable(path, e) from e
    try:
        _check_tables(path, file)
    except BaseException as e:
        file.close()
        if isinstance(e, UNREADABLE):
            raise unreadable(path, e) from e
        raise
    return file


def _check_header(path: Path) -> None:
    """Check the first 100 bytes, SQLite's file header, before SQLite reads them."""
    try:
        with path.open("rb") as file:
            header = file.read(100)
    except OSError as e:
        raise unreadable(path, e) from e
    if len(header) < 100 or not header.startswith(b"SQLite format 3\0"):
        raise unreadable(path, "no SQLite header")
    page, pages, version, application = (
        int.from_bytes(header[a:b], "big") for a, b in ((16, 18), (28, 32), (60, 64), (68, 72))
    )
    if application != APPLICATION_ID:
        raise DatabaseError(
            f"this is not a model database (application id {application:#x})",
            where=str(path),
            expected=f"application id {APPLICATION_ID:#x}",
            hint=BUILD_HINT,
        )
    if version not in TABLES_OF_VERSION:
        raise DatabaseError(
            f"this model database is of version {version}",
            where=str(path),
            expected=f"version {OLDEST_VERSION} to {VERSION}",
            hint="use a newer visup for it" if version > VERSION else BUILD_HINT,
        )
    # A page size of 65536 does not fit its field and is written as 1.
    expected, found = pages * (65536 if page == 1 else page), path.stat().st_size
    if found < expected:
        raise DatabaseError(
            f"this model database is truncated: {found} bytes",
            where=str(path),
            expected=f"{expected} bytes",
            hint=BUILD_HINT,
        )


def _check_tables(path: Path, file: sqlite3.Connection) -> None:
    """Allow only our own tables: a view or trigger in a foreign file could run for ever."""
    file.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, LARGEST_ROW_BYTES)
    file.execute("PRAGMA trusted_schema = OFF")
    file.execute("PRAGMA cell_size_check = ON")
    query = "SELECT sql FROM sqlite_master WHERE sql IS NOT NULL LIMIT 50"
    found = sorted(str(sql) for (sql,) in file.execute(query))
    tables = TABLES_OF_VERSION[version_of(file)]
    if found != sorted(tables):
        raise damaged(path, "its tables are not those of a model database", "; ".join(tables))
    layout = dict(file.execute("SELECT part, meaning FROM layout LIMIT 50").fetchall())
    if layout != LAYOUT:
        raise DatabaseError(
            "this model database is of another layout",
            where=str(path),
            expected=str(LAYOUT),
            hint=BUILD_HINT,
        )


def version_of(file: sqlite3.Connection) -> int:
    """The version of a database's tables."""
    (version,) = file.execute("PRAGMA user_version").fetchone()
    return int(version)


def read_contents(path: Path) -> FileContents:
    """Read the contents of a database except the shapes.

    Raises:
        DatabaseError: As `open_checked`; or the contents are invalid.
    """
    with closing(open_checked(path)) as file:
        try:
            names = _read_names(file)
            views, also = _read_blocks(file)
            _check_views(views, also, len(names))
            (last,) = file.execute("SELECT max(view) FROM shapes").fetchone()
            if (-1 if last is None else last) != len(views) - 1:
                raise InvalidRecordError("other views than shapes")
            has_taught_views = version_of(file) > OLDEST_VERSION
            taught = read_taught(file) if has_taught_views else ()
            meshes = read_meshes(file) if has_taught_views else ()
        except InvalidRecordError as e:
            raise damaged(path, str(e), "what 'visup models' writes") from e
        except UNREADABLE as e:
            raise unreadable(path, e) from e
    return FileContents(names, views, also, taught, meshes)


def _read_names(file: sqlite3.Connection) -> tuple[str, ...]:
    names: list[str] = []
    for code, name, crc in file.execute("SELECT code, name, crc FROM models ORDER BY code"):
        # A damaged B-tree may contain cycles: reading stops unless codes count up.
        if code != len(names) or not isinstance(name, str) or not 0 < len(name) <= LONGEST_NAME:
            raise InvalidRecordError(f"model {len(names)} without a name")
        if crc != checksum(code, name.encode()):
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
        rows = records(data, VIEW, 1, VIEWS_PER_BLOCK, f"views in block {number}")
        others = records(
            further, ALSO, 0, VIEWS_PER_BLOCK * 10_000, f"directions in block {number}"
        )
        if crc != checksum(number, data, further):
            raise InvalidRecordError(f"a wrong check sum of block {number}")
        views.append(rows)
        also.append(others)
    return np.concatenate(views), np.concatenate(also)


def _check_views(views: Records, also: Records, models: int) -> None:
    """Reject impossible views, even with correct check sums.

    Raises:
        InvalidRecordError: A view is impossible.
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
    for valid, what in (
        (unknown | (np.abs(length - 1) < 1e-3), "a direction that is not a unit vector"),
        (np.isnan(area) | ((area > 0) & np.isfinite(area)), "an area that cannot be"),
        ((smoothing >= 0) & (smoothing < 1), "a smoothing that cannot be"),
        (views["cut"] <= 1, "a mark of a cut that is none"),
        (np.isnan(views["border"]) | (np.abs(views["border"]) < 4), "a border that is nowhere"),
        (also["view"] < len(views), "a direction of no view"),
        (np.diff(also["view"].astype(np.int64)) >= 0, "directions in disorder"),
    ):
        if not bool(valid.all()):
            raise InvalidRecordError(what)
    check_nodes(views["root"])


def _numbers_within(models: Records) -> Records:
    """For each view, the number of earlier views of its model."""
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
        DatabaseError: They are missing or damaged.
    """
    query = "SELECT nodes, edges, contour, crc FROM shapes WHERE view = ?"
    try:
        row = file.execute(query, (view,)).fetchone()
    except UNREADABLE as e:
        raise unreadable(path, e) from e
    if row is None:
        raise damaged(path, f"view {view + 1} without a shape", "a shape for each view")
    *parts, crc = row
    if not all(isinstance(p, bytes) for p in parts) or crc != checksum(view, *parts):
        raise damaged(
            path, f"a wrong check sum of the shape of view {view + 1}", "what was written"
        )
    return ShapeBytes(*parts)

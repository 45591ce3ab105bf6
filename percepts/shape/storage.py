"""The database file: what stands in it, how it is written whole, and what is refused on reading.

One SQLite file, so that opening it reads a few pages only. Arrays are raw little-endian bytes with their
type and shape beside them, checked against what each field must be before anything is allocated.
"""

from __future__ import annotations

import os
import shutil
import sqlite3
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from visup.agent.errors import DatabaseError
from visup.percepts.shape.compare import Shape
from visup.percepts.shape.shock_graph import (
    CONTEXT,
    MOST_NODES,
    PROFILE,
    ShockGraph,
    frozen_graph,
)
from visup.percepts.shape.signature import LENGTH

APPLICATION_ID = 0x76697375
"""'visu' in ASCII, in the header of every database file."""

VERSION = 1
"""Version of the tables; a newer file is refused, since its meaning is not known."""

MOST_POINTS = 640
"""Points of a stored outline."""

_TABLES = """
CREATE TABLE views (
    id INTEGER PRIMARY KEY, name TEXT NOT NULL, number INTEGER NOT NULL,
    dx REAL, dy REAL, dz REAL, area REAL, cut INTEGER NOT NULL, UNIQUE (name, number));
CREATE TABLE arrays (
    view INTEGER NOT NULL REFERENCES views, field TEXT NOT NULL,
    dtype TEXT NOT NULL, rows INTEGER NOT NULL, columns INTEGER NOT NULL, data BLOB NOT NULL,
    PRIMARY KEY (view, field));
"""

_N = MOST_NODES + 1
# Half precision where it is far finer than a silhouette is known: an outline of unit area to 0.0005.
_FIELDS: dict[str, tuple[str, int, int]] = {
    # field: (dtype on disk, most rows, columns; 0 columns for a vector)
    "contour": ("<f2", MOST_POINTS, 2),
    "kinds": ("|i1", _N, 0),
    "edges": ("<i2", 2 * _N, 2),
    "weights": ("<f4", _N, 0),
    "lengths": ("<f4", _N, 0),
    "profiles": ("<f2", _N, PROFILE),
    "contexts": ("<f2", _N, CONTEXT),
    "positions": ("<f4", _N, 2),
    "directions": ("<f2", _N, 2),
    "signatures": ("<f4", _N, LENGTH),
}
_GRAPH_FIELDS = tuple(f for f in _FIELDS if f != "contour")
_BUILD_HINT = "build it anew with 'visup models build'"


@dataclass(frozen=True, slots=True)
class View:
    """One silhouette of a model.

    Attributes:
        id: Number within the database, from 1.
        name: Name of the model.
        number: Number of the view within the model, from 0.
        direction: Unit vector from the object to the viewer in the model's frame (roll: the model's +z
            is up in the picture, +y when looking along z), or None when it is not known.
        area: Area of the silhouette in model units squared, or None when the size is not known.
        cut: Whether the picture's border cuts the silhouette.
    """

    id: int
    name: str
    number: int
    direction: tuple[float, float, float] | None
    area: float | None
    cut: bool


@dataclass(frozen=True, slots=True, eq=False)
class NewView:
    """A view to be stored; fields as in `View`, with its shape.

    Attributes:
        name: Name of the model.
        direction: Unit vector from the object to the viewer, or None.
        area: Model units squared, or None.
        shape: What it looks like.
    """

    name: str
    direction: tuple[float, float, float] | None
    area: float | None
    shape: Shape


def write_new(path: Path, views: Iterable[NewView]) -> None:
    """Write a database with these views, in place of whatever stands at the path.

    Raises:
        DatabaseError: The file cannot be written; nothing is left behind.
    """
    with _replacing(path) as temporary, closing(sqlite3.connect(temporary)) as file:
        file.execute(f"PRAGMA application_id = {APPLICATION_ID}")
        file.execute(f"PRAGMA user_version = {VERSION}")
        file.executescript(_TABLES)
        _insert(file, views)


def write_more(path: Path, views: Iterable[NewView]) -> None:
    """Add views to a database; the file is replaced whole, or left as it was.

    Raises:
        DatabaseError: The file is no database of this version, or cannot be written.
    """
    with closing(open_checked(path)):
        pass
    with _replacing(path) as temporary:
        shutil.copyfile(path, temporary)
        with closing(sqlite3.connect(temporary)) as file:
            _insert(file, views)


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


def _insert(file: sqlite3.Connection, views: Iterable[NewView]) -> None:
    with file:
        for view in views:
            (number,) = file.execute(
                "SELECT coalesce(max(number), -1) + 1 FROM views WHERE name = ?", (view.name,)
            ).fetchone()
            dx, dy, dz = view.direction or (None, None, None)
            row = (view.name, number, dx, dy, dz, view.area, int(view.shape.cut))
            new = file.execute(
                "INSERT INTO views (name, number, dx, dy, dz, area, cut) VALUES (?,?,?,?,?,?,?)",
                row,
            ).lastrowid
            file.executemany("INSERT INTO arrays VALUES (?,?,?,?,?,?)", _array_rows(new, view))


def _array_rows(number: int | None, view: NewView) -> Iterator[tuple[Any, ...]]:
    for field, (dtype, _, _) in _FIELDS.items():
        value = view.shape.contour if field == "contour" else getattr(view.shape.graph, field)
        array = np.ascontiguousarray(value, dtype=dtype)
        columns = array.shape[1] if array.ndim == 2 else 0
        yield number, field, dtype, len(array), columns, array.tobytes()


def open_checked(path: Path) -> sqlite3.Connection:
    """Open a database for reading, after checking that it is one.

    Raises:
        DatabaseError: Missing, not a database, truncated, or of another version.
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
        return sqlite3.connect(f"{path.resolve().as_uri()}?mode=ro&immutable=1", uri=True)
    except sqlite3.Error as e:
        raise _unreadable(path, e) from e


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


def _unreadable(path: Path, error: object) -> DatabaseError:
    return DatabaseError(
        f"this is not a model database that can be read ({error})",
        where=str(path),
        expected="a file made by 'visup models build'",
        hint=_BUILD_HINT,
    )


def read_views(path: Path) -> tuple[View, ...]:
    """What stands in a database, without its arrays.

    Raises:
        DatabaseError: As `open_checked`; or rows that are not as they should be.
    """
    query = "SELECT id, name, number, dx, dy, dz, area, cut FROM views ORDER BY id"
    with closing(open_checked(path)) as file:
        try:
            return tuple(_view(row, path) for row in file.execute(query))
        except (sqlite3.Error, UnicodeDecodeError) as e:
            raise _unreadable(path, e) from e


def _view(row: tuple[Any, ...], path: Path) -> View:
    number, name, within, dx, dy, dz, area, cut = row
    direction = None if dx is None else (dx, dy, dz)
    sound = isinstance(name, str) and isinstance(within, int) and cut in (0, 1)
    sound = sound and (area is None or (isinstance(area, float) and 0 < area < float("inf")))
    if direction is not None:
        sound = sound and all(isinstance(d, float) and abs(d) <= 1.001 for d in direction)
    if not sound:
        raise _damaged(path, f"view {number}", "a name, a number, a direction, an area")
    return View(number, name, within, direction, area, bool(cut))


def read_shapes(path: Path, views: Sequence[View]) -> tuple[Shape, ...]:
    """The shapes of views.

    Raises:
        DatabaseError: As `open_checked`; or arrays that are missing or not as they should be.
    """
    query = "SELECT view, field, dtype, rows, columns, data FROM arrays"
    found: dict[int, dict[str, NDArray[Any]]] = {}
    with closing(open_checked(path)) as file:
        try:
            for view, *rest in file.execute(query):
                field, array = _checked_array(path, view, rest)
                found.setdefault(view, {})[field] = array
        except (sqlite3.Error, UnicodeDecodeError) as e:
            raise _unreadable(path, e) from e
    return tuple(_checked_shape(path, v, found.get(v.id, {})) for v in views)


def _checked_array(path: Path, view: int, row: Iterable[Any]) -> tuple[str, NDArray[Any]]:
    """An array from its row, when type, shape and length are as its field asks."""
    field, dtype, rows, columns, data = row
    if field not in _FIELDS:
        raise _damaged(path, f"view {view}: field {field!r}", f"one of {', '.join(_FIELDS)}")
    kind, most, width = _FIELDS[field]
    expected = f"{kind} of at most {most} rows and {width} columns"
    if dtype != kind or columns != width or not isinstance(rows, int) or not 0 <= rows <= most:
        raise _damaged(path, f"view {view}: {field} of {dtype} with {rows} x {columns}", expected)
    size = rows * max(1, width) * np.dtype(kind).itemsize
    if not isinstance(data, bytes) or len(data) != size:
        raise _damaged(path, f"view {view}: {field} of another length", f"{size} bytes")
    array = np.frombuffer(data, dtype=kind)
    if array.dtype.kind == "f" and not (np.abs(array) < 1e4).all():
        raise _damaged(
            path, f"view {view}: {field} with unlikely numbers", "magnitudes below 10000"
        )
    if array.dtype.kind == "f":
        array = array.astype(np.float32)
    return field, array.reshape(rows, width) if width else array


def _checked_shape(path: Path, view: View, arrays: dict[str, NDArray[Any]]) -> Shape:
    """A shape from its arrays, when they are all there and belong together."""
    missing = [f for f in _FIELDS if f not in arrays]
    if missing:
        raise _damaged(path, f"view {view.id} without {', '.join(missing)}", "all arrays of a view")
    if len(arrays["contour"]) < 8:
        raise _damaged(path, f"view {view.id} with a degenerate outline", "at least 8 points")
    return Shape(arrays["contour"], _checked_graph(path, view.id, arrays), view.cut)


def _checked_graph(path: Path, view: int, arrays: dict[str, NDArray[Any]]) -> ShockGraph:
    """A graph from its arrays, when they belong together."""
    size = len(arrays["kinds"])
    lengths = {len(arrays[f]) for f in _GRAPH_FIELDS if f != "edges"}
    edges, kinds = arrays["edges"], arrays["kinds"]
    sound = lengths == {size} and size >= 2 and bool(((kinds >= 0) & (kinds <= 4)).all())
    # Parents before children: the graph has no cycle.
    sound = sound and bool(((edges[:, 0] >= 0) & (edges[:, 0] < edges[:, 1])).all())
    sound = sound and bool((edges < size).all())
    positive = ("weights", "lengths", "profiles", "contexts")
    sound = sound and all(bool((arrays[f] >= 0).all()) for f in positive)
    if not sound:
        raise _damaged(path, f"view {view} with a graph that is none", "a rooted acyclic graph")
    return frozen_graph(**{f: arrays[f] for f in _GRAPH_FIELDS})


def _damaged(path: Path, found: str, expected: str) -> DatabaseError:
    return DatabaseError(
        f"this model database is damaged: {found}",
        where=str(path),
        expected=expected,
        hint=_BUILD_HINT,
    )

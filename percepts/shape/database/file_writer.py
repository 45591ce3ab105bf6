"""Writing a database file atomically.

Views are appended in blocks to a copy beside the file, which replaces it on success.
"""

from __future__ import annotations

import shutil
import sqlite3
from collections.abc import Iterable, Iterator
from contextlib import closing, contextmanager
from itertools import islice
from pathlib import Path

import numpy as np

from visup.agent.model.errors import DatabaseError
from visup.agent.storage.atomic import replacing
from visup.agent.storage.file_lock import only_writer
from visup.percepts.shape.database.file_format import (
    APPLICATION_ID,
    TABLES,
    TABLES_OF_VERSION,
    VERSION,
    VIEWS_PER_BLOCK,
    FileContents,
    checksum,
)
from visup.percepts.shape.database.file_reader import read_contents, version_of
from visup.percepts.shape.database.mesh_records import encoded_mesh, insert_meshes
from visup.percepts.shape.database.taught_records import encoded, insert_taught
from visup.percepts.shape.index.outline_sketch import sketch
from visup.percepts.shape.index.view_records import (
    ALSO,
    LAYOUT,
    POINT,
    VIEW,
    NewView,
    Records,
    encode,
    node_records,
)
from visup.percepts.shape.refinement.mesh_model import MeshModel
from visup.percepts.shape.silhouette.height_functions import outline_heights
from visup.percepts.taught.taught_view import TaughtView

LOCK_NAME = "this model database"
"""Name of a database in messages about the file lock."""


def write_new(
    path: Path,
    views: Iterable[NewView] = (),
    taught: Iterable[TaughtView] = (),
    meshes: Iterable[MeshModel] = (),
) -> None:
    """Write a database with these views, replacing any file at the path.

    Raises:
        DatabaseError: The file cannot be written; nothing is left behind.
    """
    with (
        only_writer(path, LOCK_NAME),
        _replacing(path) as temporary,
        closing(sqlite3.connect(temporary)) as file,
    ):
        file.execute("PRAGMA page_size = 8192")
        file.execute(f"PRAGMA application_id = {APPLICATION_ID}")
        file.execute(f"PRAGMA user_version = {VERSION}")
        for table in TABLES:
            file.execute(table)
        file.executemany("INSERT INTO layout VALUES (?, ?)", LAYOUT.items())
        _insert(file, FileContents((), np.empty(0, VIEW), np.empty(0, ALSO)), views)
        insert_taught(file, 0, map(encoded, taught))
        insert_meshes(file, map(encoded_mesh, meshes))


def write_more(
    path: Path, views: Iterable[NewView] = (), taught: Iterable[TaughtView] = ()
) -> None:
    """Add views to a database; the file is replaced atomically.

    A file of an older version is upgraded.

    Raises:
        DatabaseError: The file is not a readable database, or cannot be written.
    """
    with only_writer(path, LOCK_NAME), _replacing(path) as temporary:
        contents = read_contents(path)  # read while holding the lock
        shutil.copyfile(path, temporary)
        with closing(sqlite3.connect(temporary)) as file:
            _upgrade(file)
            _insert(file, contents, views)
            insert_taught(file, len(contents.taught), map(encoded, taught))


def _upgrade(file: sqlite3.Connection) -> None:
    """Add the tables that an older file lacks."""
    for table in TABLES[len(TABLES_OF_VERSION[version_of(file)]) :]:
        file.execute(table)
    file.execute(f"PRAGMA user_version = {VERSION}")


@contextmanager
def _replacing(path: Path) -> Iterator[Path]:
    """A temporary file beside the path that replaces it on success."""
    if not path.parent.is_dir():
        raise DatabaseError(
            "the database cannot be written (there is no such folder)",
            where=str(path),
            expected="a folder that exists and can be written to",
        )
    try:
        with replacing(path) as draft:
            yield draft
    except (OSError, sqlite3.Error) as e:
        raise DatabaseError(f"the database cannot be written ({e})", where=str(path)) from e


def _insert(file: sqlite3.Connection, before: FileContents, views: Iterable[NewView]) -> None:
    """Append views in blocks; models new to the file get the next codes."""
    codes = {name: code for code, name in enumerate(before.names)}
    numbers = dict(enumerate(np.bincount(before.views["model"], minlength=len(codes)).tolist()))
    (blocks,) = file.execute("SELECT coalesce(max(number), -1) + 1 FROM blocks").fetchone()
    start, remaining = len(before.views), iter(views)
    with file:
        while new := list(islice(remaining, VIEWS_PER_BLOCK)):
            for view in new:
                if view.name not in codes:
                    codes[view.name] = code = len(codes)
                    model_row = (code, view.name, checksum(code, view.name.encode()))
                    file.execute("INSERT INTO models VALUES (?, ?, ?)", model_row)
            rows, also = _block(new, start, codes, numbers)
            data = (rows.tobytes(), also.tobytes())
            row = (blocks, *data, checksum(blocks, *data))
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
        # Of the outline in its stored precision, so that every copy of a view gets the same sketch.
        rows[k]["sketch"] = sketch(outline_heights(np.asarray(view.shape.contour, POINT.base)))
        also += [(start + k, d) for d in view.also]
    return rows, np.array(also, dtype=ALSO)


def _shape_rows(new: list[NewView], start: int) -> Iterator[tuple[int, bytes, bytes, bytes, int]]:
    for k, view in enumerate(new):
        data = encode(view.shape)
        parts = (data.nodes, data.edges, data.contour)
        yield start + k, *parts, checksum(start + k, *parts)

"""The format of a database file: tables, versions, check sums, and reporting of damage.

One SQLite file. What every search needs of a view (its model, direction, root and sketch) is stored in a few
blocks, so that opening a hundred thousand views reads some megabytes; each shape has a row of its own and is
read on demand. All bytes are covered by check sums.

Version 3 adds taught views (`taught_records.py`); a file of version 2 can be read, and is upgraded to
version 3 when something is added to it.

Read next: `file_writer.py`, `file_reader.py`.
"""

from __future__ import annotations

import sqlite3
import zlib
from dataclasses import dataclass
from pathlib import Path

from visup.agent.model.errors import DatabaseError
from visup.percepts.shape.index.view_records import Records

APPLICATION_ID = 0x76697375
"""'visu' in ASCII, in the header of every database file."""

VERSION = 3
"""Version of the tables; a newer file is refused, since its meaning is unknown."""

OLDEST_VERSION = 2
"""Oldest version that can be read."""

VIEWS_PER_BLOCK = 1024
"""Most views in a block."""

LONGEST_NAME = 200
"""Most characters in a model's name."""

TABLES = (
    "CREATE TABLE layout (part TEXT PRIMARY KEY, meaning TEXT NOT NULL)",
    "CREATE TABLE models (code INTEGER PRIMARY KEY, name TEXT NOT NULL, crc INTEGER NOT NULL)",
    "CREATE TABLE blocks (number INTEGER PRIMARY KEY, views BLOB NOT NULL, also BLOB NOT NULL, "
    "crc INTEGER NOT NULL)",
    "CREATE TABLE shapes (view INTEGER PRIMARY KEY, nodes BLOB NOT NULL, edges BLOB NOT NULL, "
    "contour BLOB NOT NULL, crc INTEGER NOT NULL)",
    "CREATE TABLE taught (number INTEGER PRIMARY KEY, name TEXT NOT NULL, x INTEGER NOT NULL, "
    "y INTEGER NOT NULL, width INTEGER NOT NULL, height INTEGER NOT NULL, image BLOB NOT NULL, "
    "mask BLOB NOT NULL, scene BLOB NOT NULL, crc INTEGER NOT NULL)",
    "CREATE TABLE meshes (number INTEGER PRIMARY KEY, name TEXT NOT NULL, radius REAL NOT NULL, "
    "vertices BLOB NOT NULL, faces BLOB NOT NULL, crc INTEGER NOT NULL)",
)
TABLES_OF_VERSION = {OLDEST_VERSION: TABLES[:-2], VERSION: TABLES}
"""Version -> its tables."""

LARGEST_ROW_BYTES = 1 << 25
"""Largest row: it must hold the image of a large object in a large frame."""

# Messages about damaged tables quote their content, which may not be valid text.
UNREADABLE = (sqlite3.Error, UnicodeDecodeError)
BUILD_HINT = "build it anew with 'visup models build'"


def checksum(number: int, *parts: bytes) -> int:
    """Check sum of a row; it includes the row's number, so that rows cannot be swapped."""
    total = number
    for part in parts:
        total = zlib.crc32(part, total)
    return total


@dataclass(frozen=True, slots=True)
class TaughtRow:
    """A taught view as stored in the file.

    Attributes:
        name: Name of the object.
        place: x, y of the image in the image, and the image's width and height, pixels.
        image: PNG, three channels.
        mask: PNG, one channel, 0 and 255.
        scene: PNG, three channels.
    """

    name: str
    place: tuple[int, int, int, int]
    image: bytes
    mask: bytes
    scene: bytes

    def checksum(self, number: int) -> int:
        """Check sum of the row with this number."""
        text = "\n".join((self.name, *map(str, self.place))).encode()
        return checksum(number, text, self.image, self.mask, self.scene)


@dataclass(frozen=True, slots=True)
class MeshRow:
    """A mesh as stored in the file; see `refinement/mesh_model.py`.

    Attributes:
        name: Name of the model.
        radius: Radius of the mesh, in its own units.
        vertices: (V, 3) little-endian float32.
        faces: (F, 3) little-endian int32.
    """

    name: str
    radius: float
    vertices: bytes
    faces: bytes

    def checksum(self, number: int) -> int:
        """Check sum of the row with this number."""
        text = f"{self.name}\n{self.radius!r}".encode()
        return checksum(number, text, self.vertices, self.faces)


@dataclass(frozen=True, slots=True, eq=False)
class FileContents:
    """The contents of a file except the shapes.

    Attributes:
        names: Names of the models, in the order of the file.
        views: (V,) records of `VIEW`.
        also: (A,) records of `ALSO`, ascending by view (from 0).
        taught: Taught views, in the order of teaching.
        meshes: Meshes for pose fitting.
    """

    names: tuple[str, ...]
    views: Records
    also: Records
    taught: tuple[TaughtRow, ...] = ()
    meshes: tuple[MeshRow, ...] = ()


def damaged(path: Path, found: str, expected: str) -> DatabaseError:
    """The error for a database that is damaged."""
    return DatabaseError(
        f"this model database is damaged: {found}",
        where=str(path),
        expected=expected,
        hint=BUILD_HINT,
    )


def unreadable(path: Path, error: object) -> DatabaseError:
    """The error for a file that is not a database or that SQLite cannot read."""
    return DatabaseError(
        f"this is not a model database that can be read ({error})",
        where=str(path),
        expected="a file made by 'visup models build'",
        hint=BUILD_HINT,
    )

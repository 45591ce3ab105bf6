"""Taught views as rows of a database file: images as PNG, numbers, and a check sum.

Rows are read and their check sums verified when a database is opened; images are decoded on first use,
since a search by shape alone needs none.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Iterable
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.agent.model.errors import DatabaseError
from visup.percepts.shape.database.file_format import (
    LARGEST_ROW_BYTES,
    LONGEST_NAME,
    TaughtRow,
    damaged,
)
from visup.percepts.shape.index.view_records import InvalidRecordError
from visup.percepts.taught.taught_view import MIN_PIXELS, SCENE_WIDTH, TaughtView

MAX_PIXELS = 1 << 25
"""Most pixels of a stored image: a small file may unpack to a huge image."""

_COLUMNS = "name, x, y, width, height, image, mask, scene, crc"
_PNG_HEADER = b"\x89PNG\r\n\x1a\n\x00\x00\x00\rIHDR"


def checked_name(name: str) -> str:
    """An object's name as stored, without surrounding blanks.

    Raises:
        DatabaseError: The name is not valid.
    """
    bare = name.strip()
    if not 0 < len(bare) <= LONGEST_NAME or not bare.isprintable():
        raise DatabaseError(
            f"a taught thing cannot be called {bare[:40]!r}",
            expected=f"1 to {LONGEST_NAME} printable characters",
        )
    return bare


def encoded(view: TaughtView) -> TaughtRow:
    """The row of a view.

    Raises:
        DatabaseError: Its name or its image is too large to be stored.
    """
    name = checked_name(view.name)
    mask = view.mask.astype(np.uint8) * np.uint8(255)
    row = TaughtRow(
        name,
        (*view.origin, *view.frame_size),
        *(cv2.imencode(".png", p)[1].tobytes() for p in (view.image, mask, view.scene)),
    )
    size = len(row.image) + len(row.mask) + len(row.scene)
    if size > LARGEST_ROW_BYTES - (1 << 16) or view.mask.size > MAX_PIXELS:
        raise DatabaseError(
            f"the picture of '{name}' is too large to be stored ({size / 1e6:.0f} MB)",
            expected=f"at most {LARGEST_ROW_BYTES / 1e6:.0f} MB and {MAX_PIXELS} pixels",
            hint="show it in a picture of fewer pixels",
        )
    return row


def decoded(path: Path, number: int, row: TaughtRow) -> TaughtView:
    """The view of a row.

    Raises:
        DatabaseError: The row holds no valid view.
    """
    try:
        image, scene = _decode_colour(row.image), _decode_colour(row.scene)
        mask = _decode(row.mask, cv2.IMREAD_GRAYSCALE) > 127
        _check(row, image, mask, scene)
    except InvalidRecordError as e:
        raise damaged(path, f"taught view {number + 1} with {e}", "what was taught") from e
    return TaughtView(
        name=row.name,
        image=image,
        mask=mask,
        origin=row.place[:2],
        frame_size=row.place[2:],
        scene=scene,
    )


def _decode_colour(data: bytes) -> NDArray[np.uint8]:
    return _decode(data, cv2.IMREAD_COLOR)


def _decode(data: bytes, kind: int) -> NDArray[np.uint8]:
    """Decode a PNG, refusing implausible sizes."""
    if not data.startswith(_PNG_HEADER) or len(data) < 33:
        raise InvalidRecordError("a picture that is none")
    width, height = (int.from_bytes(data[a : a + 4], "big") for a in (16, 20))
    if not 0 < width * height <= MAX_PIXELS:
        raise InvalidRecordError(f"a picture of {width} x {height} pixels")
    try:
        image = cv2.imdecode(np.frombuffer(data, np.uint8), kind)
    except cv2.error:
        image = None
    if image is None:
        raise InvalidRecordError("a picture that is none")
    return np.asarray(image, dtype=np.uint8)


def _check(
    row: TaughtRow, image: NDArray[np.uint8], mask: NDArray[np.bool_], scene: NDArray[np.uint8]
) -> None:
    x, y, width, height = row.place
    for valid, what in (
        (image.shape[:2] == mask.shape, "an outline of another size than its picture"),
        (min(x, y) >= 0, "a place outside its picture"),
        (x + mask.shape[1] <= width, "a place outside its picture"),
        (y + mask.shape[0] <= height, "a place outside its picture"),
        (np.count_nonzero(mask) >= MIN_PIXELS, "nothing in its outline"),
        (scene.shape[1] <= SCENE_WIDTH, "a scene that is too wide"),
    ):
        if not valid:
            raise InvalidRecordError(what)


def read_taught(file: sqlite3.Connection) -> tuple[TaughtRow, ...]:
    """All taught rows of a file, with verified check sums.

    Raises:
        InvalidRecordError: A row is damaged.
    """
    rows: list[TaughtRow] = []
    query = f"SELECT number, {_COLUMNS} FROM taught ORDER BY number"
    for expected, (number, *columns, crc) in enumerate(file.execute(query)):
        name, *place, image, mask, scene = columns
        if number != expected:
            raise InvalidRecordError(f"taught view {expected + 1} is missing")
        if not isinstance(name, str) or not 0 < len(name) <= LONGEST_NAME:
            raise InvalidRecordError(f"taught view {number + 1} without a name")
        valid = all(isinstance(p, bytes) for p in (image, mask, scene))
        valid &= all(isinstance(n, int) and abs(n) < 1 << 20 for n in place)
        row = TaughtRow(name, tuple(place), image, mask, scene)
        if not valid or crc != row.checksum(number):
            raise InvalidRecordError(f"a wrong check sum of taught view {number + 1}")
        rows.append(row)
    return tuple(rows)


def insert_taught(file: sqlite3.Connection, before: int, rows: Iterable[TaughtRow]) -> None:
    """Append rows to a file that already has `before` rows."""
    with file:
        for number, row in enumerate(rows, start=before):
            columns = (row.name, *row.place, row.image, row.mask, row.scene)
            file.execute(
                "INSERT INTO taught VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
                (number, *columns, row.checksum(number)),
            )

"""Damaged database files and masks that no camera gives, of many kinds, drawn from a seed."""

from __future__ import annotations

import sqlite3
import zipfile
import zlib
from collections.abc import Callable
from contextlib import closing
from io import BytesIO
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.percepts.shape.index.view_records import NODE, VIEW

Random = np.random.Generator
Mask = NDArray[np.generic]

PAGE = 8192
"""Bytes of a page of a database file."""

LARGE = 8192
"""Side of the largest masks, pixels."""

_NUMBERS = (0.0, -1.0, 1e9, -1e30, np.nan, np.inf, -np.inf)


def corrupt_file(path: Path, sound: bytes, kind: str, rng: Random) -> None:
    """Write a damaged copy of a sound database file.

    Args:
        path: Where; whatever stands there is replaced.
        sound: The sound file.
        kind: A key of `CORRUPTIONS`.
        rng: Of everything that is drawn.
    """
    if path.is_dir():
        path.rmdir()
    path.write_bytes(sound)
    CORRUPTIONS[kind](path, sound, rng)


def _flipped(path: Path, sound: bytes, rng: Random) -> None:
    """Some bits are others."""
    content = np.frombuffer(sound, np.uint8).copy()
    at = rng.integers(0, len(content), int(rng.integers(1, 21)))
    content[at] ^= (1 << rng.integers(0, 8, len(at))).astype(np.uint8)
    path.write_bytes(content.tobytes())


def _header(path: Path, sound: bytes, rng: Random) -> None:
    """Some bytes of the header and of the table of tables are others."""
    content = np.frombuffer(sound, np.uint8).copy()
    at = rng.integers(16, 400, int(rng.integers(1, 6)))
    content[at] = rng.integers(0, 256, len(at))
    path.write_bytes(content.tobytes())


def _truncated(path: Path, sound: bytes, rng: Random) -> None:
    """The end is missing."""
    path.write_bytes(sound[: int(rng.integers(0, len(sound)))])


def _swapped(path: Path, sound: bytes, rng: Random) -> None:
    """Two pages have changed places, or one stands twice."""
    pages = [sound[k : k + PAGE] for k in range(0, len(sound), PAGE)]
    a, b = rng.integers(1, len(pages), 2)
    pages[a], pages[b] = pages[b], pages[a] if rng.random() < 0.5 else pages[b]
    path.write_bytes(b"".join(pages))


def _shifted(path: Path, sound: bytes, rng: Random) -> None:
    """Bytes are missing in the middle, or too many there."""
    at, count = int(rng.integers(0, len(sound))), int(rng.integers(1, 2 * PAGE))
    more = rng.bytes(count) + sound[at:]
    path.write_bytes(sound[:at] + (more if rng.random() < 0.5 else sound[at + count :]))


def _blotted(path: Path, sound: bytes, rng: Random) -> None:
    """A stretch is zero, full, or noise."""
    at, count = int(rng.integers(100, len(sound))), int(rng.integers(1, 4 * PAGE))
    count = min(count, len(sound) - at)
    blot = (bytes(count), b"\xff" * count, rng.bytes(count))[int(rng.integers(3))]
    path.write_bytes(sound[:at] + blot + sound[at + count :])


def _foreign(path: Path, sound: bytes, rng: Random) -> None:
    """Something else altogether."""
    kind = int(rng.integers(7))
    if kind == 0:
        path.unlink()
        path.mkdir()
        return
    picture = cv2.imencode(".png", rng.integers(0, 256, (40, 40), dtype=np.uint8))[1].tobytes()
    head = sound[: int(rng.integers(0, 100))]
    others = (b"", rng.bytes(5000), picture, _zip_bomb(), head, b"name,view\n" * 500)
    path.write_bytes(others[kind - 1])


def _zip_bomb() -> bytes:
    out = BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr("views", bytes(10_000_000))
    return out.getvalue()


def _other_version(path: Path, sound: bytes, rng: Random) -> None:
    """A newer or older version, or another program's file."""
    pragma = ("user_version", "application_id")[int(rng.integers(2))]
    _run(path, f"PRAGMA {pragma} = {int(rng.integers(-(2**31), 2**31))}")


def _other_tables(path: Path, sound: bytes, rng: Random) -> None:
    """Tables missing, emptied, of other columns, or views that compute for ever."""
    table = ("layout", "models", "blocks", "shapes")[int(rng.integers(4))]
    endless = (
        f"CREATE VIEW {table} AS WITH RECURSIVE c(n) AS (SELECT 0 UNION ALL SELECT n + 1 FROM c) "
        "SELECT n AS code, n AS number, n AS view, n AS name, n AS crc FROM c"
    )
    _run(
        path,
        *(
            (f"DROP TABLE {table}",),
            (f"DELETE FROM {table}",),
            (f"ALTER TABLE {table} ADD COLUMN extra",),
            (f"DROP TABLE {table}", endless),
            (f"CREATE TRIGGER t AFTER INSERT ON {table} BEGIN SELECT 1; END",),
        )[int(rng.integers(5))],
    )


def _huge(path: Path, sound: bytes, rng: Random) -> None:
    """Blobs of sizes that no view has, from nothing to beyond what is ever read."""
    table, column = _BLOBS[int(rng.integers(len(_BLOBS)))]
    size = int(rng.choice([0, 1, VIEW.itemsize * 2000, NODE.itemsize * 500, 20_000_000]))
    _run(path, f"UPDATE {table} SET {column} = zeroblob({size})")


_BLOBS = (
    ("blocks", "views"),
    ("blocks", "also"),
    ("shapes", "nodes"),
    ("shapes", "edges"),
    ("shapes", "contour"),
)


def _other_types(path: Path, sound: bytes, rng: Random) -> None:
    """Texts, numbers and nothing where bytes or numbers should be."""
    if rng.random() < 0.3:
        # What numbers the rows is a whole number by SQLite's own rules.
        table, column = (("models", "code"), ("blocks", "number"))[int(rng.integers(2))]
        value = ("-1", "9223372036854775807", "7")[int(rng.integers(3))]
    else:
        cells = (*_BLOBS, ("models", "name"), ("models", "crc"), ("shapes", "crc"))
        table, column = cells[int(rng.integers(len(cells)))]
        value = ("'text'", "-1", "1e300", "x''", "x'ff00'")[int(rng.integers(5))]
    _run(path, f"UPDATE OR IGNORE {table} SET {column} = {value}")


def _hostile(path: Path, sound: bytes, rng: Random) -> None:
    """Values that cannot be, with check sums that agree."""
    with closing(sqlite3.connect(path)) as file, file:
        if rng.random() < 0.5:
            for number, data, also in file.execute("SELECT number, views, also FROM blocks"):
                rows = _with_odd_value(np.frombuffer(data, VIEW).copy(), rng).tobytes()
                row = (rows, _sum(number, rows, also), number)
                file.execute("UPDATE blocks SET views = ?, crc = ? WHERE number = ?", row)
            return
        query = "SELECT view, nodes, edges, contour FROM shapes"
        for view, *parts in file.execute(query).fetchall():
            which = int(rng.integers(3))
            if which == 0:
                parts[0] = _with_odd_value(np.frombuffer(parts[0], NODE).copy(), rng).tobytes()
            else:
                dtype = (np.int16, np.float16)[which - 1]
                values = np.frombuffer(parts[which], dtype).copy()
                odd = rng.integers(-(2**15), 2**15, len(values)).astype(np.int16).view(dtype)
                chosen = rng.random(len(values)) < rng.choice([0.01, 0.2, 1.0])
                parts[which] = np.where(chosen, odd, values).tobytes()
            row = (*parts, _sum(view, *parts), view)
            file.execute(
                "UPDATE shapes SET nodes = ?, edges = ?, contour = ?, crc = ? WHERE view = ?", row
            )


def _with_odd_value(rows: NDArray[np.void], rng: Random) -> NDArray[np.void]:
    """Records of which one field, anywhere below, has an odd value in some of them."""
    names = rows.dtype.names or ()
    field = names[int(rng.integers(len(names)))]
    chosen = rng.random(len(rows)) < rng.choice([0.1, 1.0])
    chosen[int(rng.integers(len(rows)))] = True
    part = rows[field]
    if part.dtype.names:
        rows[field] = _with_odd_value(part.copy(), rng)
    elif part.dtype.kind == "f":
        part[chosen] = np.clip(_NUMBERS[int(rng.integers(len(_NUMBERS)))], -6e4, 6e4)
    else:
        part[chosen] = np.frombuffer(rng.bytes(part.dtype.itemsize), part.dtype)[0]
    return rows


def _sum(number: int, *parts: bytes) -> int:
    for part in parts:
        number = zlib.crc32(part, number)
    return number


def _run(path: Path, *commands: str) -> None:
    with closing(sqlite3.connect(path)) as file:
        for command in commands:
            file.execute(command)
        file.commit()


CORRUPTIONS: dict[str, Callable[[Path, bytes, Random], None]] = {
    "flipped": _flipped,
    "header": _header,
    "truncated": _truncated,
    "swapped": _swapped,
    "shifted": _shifted,
    "blotted": _blotted,
    "foreign": _foreign,
    "version": _other_version,
    "tables": _other_tables,
    "huge": _huge,
    "types": _other_types,
    "hostile": _hostile,
}
"""Kinds of damage to a database file."""

HARMLESS = ("flipped", "header", "truncated", "swapped", "shifted", "blotted")
"""Kinds that accident brings: what is still read must be what was written."""


def odd_mask(kind: str, size: tuple[int, int], rng: Random) -> Mask:
    """A mask that no camera gives.

    Args:
        kind: A key of `MASKS`.
        size: (height, width); some kinds choose their own.
        rng: Of everything that is drawn.
    """
    return MASKS[kind](size, rng)


def _full(size: tuple[int, int], rng: Random) -> Mask:
    return np.ones(size, dtype=bool)


def _empty(size: tuple[int, int], rng: Random) -> Mask:
    return np.zeros(size, dtype=bool)


def _points(size: tuple[int, int], rng: Random) -> Mask:
    """One pixel, or a few."""
    out = np.zeros(size, dtype=bool)
    count = int(rng.choice([1, 2, 23, 24, 25, 200]))
    out[rng.integers(0, size[0], count), rng.integers(0, size[1], count)] = True
    return out


def _lines(size: tuple[int, int], rng: Random) -> Mask:
    """Lines of any width, straight, crossing, or a frame."""
    out = np.zeros(size, dtype=np.uint8)
    for _ in range(int(rng.integers(1, 5))):
        (x0, x1), (y0, y1) = rng.integers(0, size[1], 2), rng.integers(0, size[0], 2)
        width = int(rng.choice([1, 2, 5]))
        if rng.random() < 0.3:
            cv2.rectangle(out, (int(x0), int(y0)), (int(x1), int(y1)), 1, width)
        cv2.line(out, (int(x0), int(y0)), (int(x1), int(y1)), 1, width)
    return out > 0


def _checkered(size: tuple[int, int], rng: Random) -> Mask:
    cell = int(rng.choice([1, 2, 3, 8, 40]))
    y, x = np.ogrid[: size[0], : size[1]]
    return np.asarray((x // cell + y // cell) % 2 == 0)


def _combed(size: tuple[int, int], rng: Random) -> Mask:
    """Many limbs on a spine."""
    cell = int(rng.choice([2, 6, 20, 100]))
    y, x = np.ogrid[: size[0], : size[1]]
    return np.asarray((x % cell < max(1, cell // 2)) | (y < cell))


def _holed(size: tuple[int, int], rng: Random) -> Mask:
    cell = int(rng.choice([3, 10, 50]))
    y, x = np.ogrid[: size[0], : size[1]]
    return np.asarray((x % cell != 1) | (y % cell != 1))


def _noise(size: tuple[int, int], rng: Random) -> Mask:
    level = float(rng.choice([0.01, 0.3, 0.5, 0.6, 0.95]))
    return np.asarray(rng.random(size, dtype=np.float32) < level)


def _blobs(size: tuple[int, int], rng: Random) -> Mask:
    """Smooth noise: land and water."""
    grain = rng.normal(size=(int(rng.integers(2, 90)), int(rng.integers(2, 90))))
    grown = cv2.resize(grain.astype(np.float32), size[::-1], interpolation=cv2.INTER_CUBIC)
    return np.asarray(grown > rng.uniform(-0.5, 0.8))


def _spiral(size: tuple[int, int], rng: Random) -> Mask:
    y, x = np.ogrid[: size[0], : size[1]]
    y, x = y - size[0] / 2, x - size[1] / 2
    pitch = float(rng.choice([3, 12, 60]))
    return np.asarray((np.hypot(x, y) / pitch + np.arctan2(y, x) / (2 * np.pi)) % 1 < 0.5)


def _other_type(size: tuple[int, int], rng: Random) -> Mask:
    """Other types, and other numbers of dimensions."""
    mask = _blobs(size, rng)
    dtype = ("u1", "i8", "u2", "f4", "f8", "c8", "O", "U1", "i1")[int(rng.integers(9))]
    given = mask.astype(dtype)
    if given.dtype.kind == "f":
        given[0, 0] = np.nan
    extra = int(rng.integers(4))
    return (given, given[None], given[0], given[..., None])[extra]


def _no_extent(size: tuple[int, int], rng: Random) -> Mask:
    """Pictures without rows or columns, or with one only."""
    shape = ((0, 0), (0, size[1]), (size[0], 0), (1, size[1]), (size[0], 1), (1, 1))
    return np.ones(shape[int(rng.integers(6))], dtype=bool)


MASKS: dict[str, Callable[[tuple[int, int], Random], Mask]] = {
    "full": _full,
    "empty": _empty,
    "points": _points,
    "lines": _lines,
    "checkered": _checkered,
    "combed": _combed,
    "holed": _holed,
    "noise": _noise,
    "blobs": _blobs,
    "spiral": _spiral,
    "type": _other_type,
    "extent": _no_extent,
}
"""Kinds of masks that no camera gives."""

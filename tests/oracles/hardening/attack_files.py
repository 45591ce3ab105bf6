"""What attacks are made of: clips, runs, pictures, tables and texts that mean harm."""

from __future__ import annotations

import json
import sqlite3
import struct
import zlib
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

from tests.clips import moving_disc, write_clip
from tests.oracles.hardening.subjects import interrupted_run_at
from visup.agent.storage.journal_reader import JOURNAL

Make = Callable[[Path], object]

EVIL = "\x1b[2J\x1b]0;owned\x07\x9b31m\u202egnp"
"""What a terminal would obey."""


def clip(folder: Path, count: int = 12) -> Path:
    """A sound clip."""
    return write_clip(folder / "clip.avi", moving_disc(count), fps=10.0)


def text(name: str, content: str) -> Make:
    """A file of text beside a sound clip."""

    def make(folder: Path) -> None:
        clip(folder)
        (folder / name).write_text(content, encoding="utf-8", errors="surrogateescape")

    return make


def link(name: str, to: str) -> Make:
    """A file that is a link to somewhere else, beside a sound clip."""

    def make(folder: Path) -> None:
        clip(folder)
        (folder / name).symlink_to(to)

    return make


def run(folder: Path) -> Path:
    """A run that was killed in its middle, with its clip."""
    return interrupted_run_at(folder, clip(folder))


def run_with(**settings: Any) -> Make:
    """A run whose recorded settings were changed by a stranger."""

    def make(folder: Path) -> None:
        changed = {k: v.replace("FOLDER", str(folder)) if isinstance(v, str) else v
                   for k, v in settings.items()}  # fmt: skip
        with closing(sqlite3.connect(run(folder) / JOURNAL)) as db:
            (old,) = db.execute("SELECT value FROM run WHERE key = 'settings'").fetchone()
            new = json.dumps({**json.loads(old), **changed})
            db.execute("UPDATE run SET value = ? WHERE key = 'settings'", (new,))
            db.commit()

    return make


def run_after(*statements: str) -> Make:
    """A run whose journal was changed by statements of SQL."""

    def make(folder: Path) -> None:
        with closing(sqlite3.connect(run(folder) / JOURNAL)) as db:
            for statement in statements:
                db.execute(statement)
            db.commit()

    return make


def run_seeing(change: Callable[[dict[str, Any]], object]) -> Make:
    """A run of which one step was perceived otherwise; its check sum is right."""

    return lambda folder: change_seen(run(folder), 5, change)


def change_seen(folder: Path, frame: int, change: Callable[[dict[str, Any]], object]) -> None:
    """Change what was perceived in one frame of a recorded run, with the check sum that goes with it."""
    with closing(sqlite3.connect(folder / JOURNAL)) as db:
        (seen,) = db.execute("SELECT seen FROM steps WHERE frame_index = ?", (frame,)).fetchone()
        document = json.loads(zlib.decompress(seen))
        change(document)
        packed = zlib.compress(json.dumps(document).encode())
        row = (packed, zlib.crc32(packed), frame)
        db.execute("UPDATE steps SET seen = ?, crc = ? WHERE frame_index = ?", row)
        db.commit()


def giant_png(path: Path, side: int = 30_000) -> Path:
    """A grey picture of many pixels in few bytes."""
    packer = zlib.compressobj(9)
    row = b"\0" * (side + 1)
    data = b"".join(packer.compress(row) for _ in range(side)) + packer.flush()

    def chunk(kind: bytes, body: bytes) -> bytes:
        crc = zlib.crc32(kind + body)
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", crc)

    head = struct.pack(">IIBBBBB", side, side, 8, 0, 0, 0, 0)
    path.write_bytes(
        b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", data) + chunk(b"IEND", b"")
    )
    return path


def together(*makes: Make) -> Make:
    """All of these."""

    def make(folder: Path) -> None:
        for one in makes:
            one(folder)

    return make

"""Room that a database keeps for itself, so that it can be written to for a while on a full disk.

Pages that are free stay in a file of SQLite and are used before it grows; a log that is not cut short is
written over from its beginning. Both are on the disk already: nobody else can take them.
"""

from __future__ import annotations

import os
import sqlite3
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

TRY_AGAIN = 25
"""Looks that are left out after one that found no room."""


@dataclass(slots=True)
class PageReserve:
    """Free pages of a database.

    Args:
        size: Bytes that are to be free; less than half of it is filled up again.
        fill: A statement that takes so many bytes, given their number.
        clear: The one that gives them back.
    """

    size: int
    fill: str
    clear: str
    _left_out: int = 0

    def keep(self, db: sqlite3.Connection) -> None:
        """Fill the reserve up when it is time to; where there is no room it is tried again later."""
        if not self.size or self._left_out > 0:
            self._left_out -= 1
            return
        with suppress(sqlite3.Error):
            (page,) = db.execute("PRAGMA page_size").fetchone()
            (free,) = db.execute("PRAGMA freelist_count").fetchone()
            if 2 * free * page >= self.size:
                return
            self._left_out = TRY_AGAIN
            # Two transactions: pages that are taken and given back in one are never written.
            db.execute(self.fill, (self.size - free * page,))
            db.execute(self.clear)
            self._left_out = 0


def lengthen(path: Path, size: int) -> None:
    """Let a file that is written over from its beginning have its full length now.

    Args:
        path: It need not exist.
        size: Bytes; the file is not made shorter.

    Raises:
        OSError: There is no room.
    """
    handle = os.open(path, os.O_WRONLY | os.O_CREAT, 0o644)
    try:
        missing = size - os.fstat(handle).st_size
        os.lseek(handle, 0, os.SEEK_END)
        while missing > 0:
            missing -= os.write(handle, bytes(missing))
    finally:
        os.close(handle)

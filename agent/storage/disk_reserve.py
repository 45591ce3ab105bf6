"""Reserved space in a database, so that it stays writable for a while on a full disk.

Free pages stay in an SQLite file and are used before it grows; a log that is not truncated is overwritten
from its beginning. Both already occupy the disk, so that no other program can take the space.
"""

from __future__ import annotations

import os
import sqlite3
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

TRY_AGAIN = 25
"""Calls skipped after one that found no space."""


@dataclass(slots=True)
class PageReserve:
    """Free pages of a database.

    Args:
        size: Bytes to keep free; refilled when less than half is left.
        fill: A statement that occupies a given number of bytes.
        clear: The statement that frees them.
    """

    size: int
    fill: str
    clear: str
    _left_out: int = 0

    def keep(self, db: sqlite3.Connection) -> None:
        """Refill the reserve if needed; without space it is tried again later."""
        if not self.size or self._left_out > 0:
            self._left_out -= 1
            return
        with suppress(sqlite3.Error):
            (page,) = db.execute("PRAGMA page_size").fetchone()
            (free,) = db.execute("PRAGMA freelist_count").fetchone()
            if 2 * free * page >= self.size:
                return
            self._left_out = TRY_AGAIN
            # Two transactions: pages allocated and freed in one are never written.
            db.execute(self.fill, (self.size - free * page,))
            db.execute(self.clear)
            self._left_out = 0


def lengthen(path: Path, size: int) -> None:
    """Extend a file to its full length in advance.

    Args:
        path: The file; it need not exist.
        size: Bytes; the file is never shortened.

    Raises:
        OSError: There is no space.
    """
    handle = os.open(path, os.O_WRONLY | os.O_CREAT, 0o644)
    try:
        missing = size - os.fstat(handle).st_size
        os.lseek(handle, 0, os.SEEK_END)
        while missing > 0:
            missing -= os.write(handle, bytes(missing))
    finally:
        os.close(handle)

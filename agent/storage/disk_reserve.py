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

CALLS_BEFORE_RETRY = 25
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
    _calls_to_skip: int = 0

    def keep(self, db: sqlite3.Connection) -> None:
        """Refill the reserve if needed; without space it is tried again later."""
        if not self.size or self._calls_to_skip > 0:
            self._calls_to_skip -= 1
            return
        with suppress(sqlite3.Error):
            (page_bytes,) = db.execute("PRAGMA page_size").fetchone()
            (free_pages,) = db.execute("PRAGMA freelist_count").fetchone()
            if 2 * free_pages * page_bytes >= self.size:
                return
            self._calls_to_skip = CALLS_BEFORE_RETRY
            # Two transactions: pages allocated and freed in one are never written.
            db.execute(self.fill, (self.size - free_pages * page_bytes,))
            db.execute(self.clear)
            self._calls_to_skip = 0


def preallocate(path: Path, size: int) -> None:
    """Extend a file to its full length in advance.

    Args:
        path: The file; it need not exist.
        size: Bytes; the file is never shortened.

    Raises:
        OSError: There is no space.
    """
    descriptor = os.open(path, os.O_WRONLY | os.O_CREAT, 0o644)
    try:
        missing = size - os.fstat(descriptor).st_size
        os.lseek(descriptor, 0, os.SEEK_END)
        while missing > 0:
            missing -= os.write(descriptor, bytes(missing))
    finally:
        os.close(descriptor)

"""Atomic and durable replacement of files, safe against crashes and loss of power."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Write a draft that replaces a file once it is on disk.

    Args:
        path: The file to replace; it need not exist.

    Yields:
        The empty draft; it is removed in any case.

    Raises:
        OSError: It cannot be written; the old file is unchanged.
    """
    descriptor, name = tempfile.mkstemp(prefix=f".{path.name}.", suffix=".part", dir=path.parent)
    os.close(descriptor)
    draft = Path(name)
    try:
        yield draft
        draft.chmod(0o644)  # mkstemp denies access to others
        sync(draft)
        draft.replace(path)
        sync(path.parent)
    finally:
        draft.unlink(missing_ok=True)


def write_atomically(path: Path, data: bytes) -> None:
    """Write a file atomically.

    Raises:
        OSError: It cannot be written; the old file is unchanged.
    """
    with replacing(path) as draft:
        draft.write_bytes(data)


def sync(path: Path) -> None:
    """Wait until a file, or the entries of a folder, are on disk (fsync)."""
    if os.name == "nt" and path.is_dir():
        return  # not possible on Windows
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)

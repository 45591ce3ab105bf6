"""Text files that others wrote, read within bounds: regular files of a limited size, in UTF-8."""

from __future__ import annotations

import os
import stat
from errno import EFBIG, EINVAL
from pathlib import Path
from typing import IO

PIECE_BYTES = 2**20
LARGEST_TEXT_BYTES = 2**20
"""No task, rules, zones or settings are larger; the largest that ship take a hundredth of it."""


def read_text_file(path: Path, most: int = LARGEST_TEXT_BYTES) -> str:
    """The text of a file; a mark of the byte order at its beginning is no part of it.

    Raises:
        OSError: It cannot be read, is a device or a pipe, or is larger than that.
        UnicodeDecodeError: It is not UTF-8.
    """
    return read_bounded(path, most).decode("utf-8-sig").replace("\r\n", "\n").replace("\r", "\n")


def read_bounded(path: Path, most: int) -> bytes:
    """The bytes of a regular file that is no larger than that.

    Raises:
        OSError: It cannot be read, is a device or a pipe, or is larger.
    """
    # What is no file may never come to an end, or to a beginning.
    handle = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0))
    with open(handle, "rb") as file:  # noqa: PTH123  # of a descriptor
        facts = os.fstat(handle)
        if not stat.S_ISREG(facts.st_mode):
            raise OSError(EINVAL, "it is not a file", str(path))
        data = b"" if facts.st_size > most else _read_at_most(file, most + 1)
    if max(len(data), facts.st_size) > most:
        raise OSError(EFBIG, f"it is larger than {_size(most)}", str(path))
    return data


def _read_at_most(file: IO[bytes], most: int) -> bytes:
    """So many bytes or fewer; memory is taken for what is there, not for what may be asked for."""
    pieces, left = [], most
    while left and (piece := file.read(min(left, PIECE_BYTES))):
        pieces.append(piece)
        left -= len(piece)
    return b"".join(pieces)


MOST_VALUES = 4_000_000
"""No document holds more values: an empty list takes two bytes of text, and thirty times that in memory."""


def check_room(text: bytes, most: int = MOST_VALUES, marks: bytes = b",[{") -> None:
    """Refuse a document that would take far more memory than its text does.

    Args:
        text: The document: JSON, unless `marks` are others.
        most: How many values it may hold.
        marks: Characters of which each begins a value.

    Raises:
        ValueError: It holds more.
    """
    if sum(text.count(mark) for mark in marks) > most:
        raise ValueError(f"it holds more than {most} values")


def _size(most: int) -> str:
    return f"{most >> 20} MB" if most >= 2**20 else f"{most} bytes"

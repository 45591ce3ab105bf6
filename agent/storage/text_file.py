"""Reads untrusted text files within bounds: regular files of limited size in UTF-8."""

from __future__ import annotations

import os
import stat
from errno import EFBIG, EINVAL
from pathlib import Path
from typing import IO

CHUNK_BYTES = 2**20
LARGEST_TEXT_BYTES = 2**20
"""Maximum size of tasks, rules, zones and settings; the largest shipped ones have a hundredth of it."""


def read_text_file(path: Path, most: int = LARGEST_TEXT_BYTES) -> str:
    """The text of a file without a byte order mark.

    Raises:
        OSError: It cannot be read, is a device or a pipe, or is larger than that.
        UnicodeDecodeError: It is not UTF-8.
    """
    return read_bounded(path, most).decode("utf-8-sig").replace("\r\n", "\n").replace("\r", "\n")


def read_bounded(path: Path, most: int) -> bytes:
    """The bytes of a regular file of limited size.

    Raises:
        OSError: It cannot be read, is a device or a pipe, or is larger.
    """
    # Opening or reading a device or pipe may block forever.
    descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0))
    with open(descriptor, "rb") as file:  # noqa: PTH123  # opens a descriptor
        status = os.fstat(descriptor)
        if not stat.S_ISREG(status.st_mode):
            raise OSError(EINVAL, "it is not a file", str(path))
        data = b"" if status.st_size > most else _read_at_most(file, most + 1)
    if max(len(data), status.st_size) > most:
        raise OSError(EFBIG, f"it is larger than {_size(most)}", str(path))
    return data


def _read_at_most(file: IO[bytes], most: int) -> bytes:
    """At most a number of bytes; memory is allocated for the actual content, not for the limit."""
    chunks, remaining = [], most
    while remaining and (chunk := file.read(min(remaining, CHUNK_BYTES))):
        chunks.append(chunk)
        remaining -= len(chunk)
    return b"".join(chunks)


MAX_VALUES = 4_000_000
"""Maximum number of values in a document: an empty list takes 2 bytes of text and thirty times that in
memory."""


def check_room(text: bytes, most: int = MAX_VALUES, marks: bytes = b",[{") -> None:
    """Refuse a document that would need far more memory than its text.

    Args:
        text: The document; JSON with the default `marks`.
        most: Maximum number of values.
        marks: Characters that each begin a value.

    Raises:
        ValueError: It has more.
    """
    if sum(text.count(mark) for mark in marks) > most:
        raise ValueError(f"it holds more than {most} values")


def _size(most: int) -> str:
    return f"{most >> 20} MB" if most >= 2**20 else f"{most} bytes"

"""Silences OpenCV and FFmpeg, since visup reports errors itself."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager

STDERR = 2


def hush_decoder() -> None:
    """Ask FFmpeg inside OpenCV for silence; it reads this once, when it first opens a video."""
    os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")


@contextmanager
def quiet() -> Iterator[None]:
    """Drop what native code writes to standard error while a file is opened.

    The libraries write to the file descriptor itself, so that it is what must be turned away. Kept
    to short moments, since it silences the whole process.
    """
    try:
        sys.stderr.flush()
        kept = os.dup(STDERR)
    except (OSError, ValueError, AttributeError):  # no standard error to protect
        yield
        return
    try:
        with open(os.devnull, "wb") as nowhere:  # noqa: PTH123
            os.dup2(nowhere.fileno(), STDERR)
        yield
    finally:
        os.dup2(kept, STDERR)
        os.close(kept)

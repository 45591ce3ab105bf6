"""Silencing of OpenCV and FFmpeg, since visup reports errors itself."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager

STDERR = 2


def hush_decoder() -> None:
    """Set FFmpeg inside OpenCV to quiet; it reads this once, when it first opens a video."""
    os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")


@contextmanager
def quiet() -> Iterator[None]:
    """Discard native output to standard error while a file is opened.

    The libraries write to the file descriptor itself, which must therefore be redirected. Only for short
    moments, since it silences the whole process.
    """
    try:
        sys.stderr.flush()
        saved = os.dup(STDERR)
    except (OSError, ValueError, AttributeError):  # no standard error to protect
        yield
        return
    try:
        with open(os.devnull, "wb") as nowhere:  # noqa: PTH123
            os.dup2(nowhere.fileno(), STDERR)
        yield
    finally:
        os.dup2(saved, STDERR)
        os.close(saved)

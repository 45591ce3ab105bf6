"""File names that are safe for OpenCV, which crashes on names that are not UTF-8."""

from __future__ import annotations

import atexit
import os
import shutil
import tempfile
from functools import lru_cache
from pathlib import Path


def opencv_name(path: str | os.PathLike[str]) -> str:
    """A name by which OpenCV can open or write a file.

    Names on disk are bytes. Where they are not UTF-8 (an old archive, a bare `LC_ALL=POSIX`), Python
    represents them with surrogates, on which OpenCV's bindings abort the process. Such a file is reached
    through a link with a plain name, which lasts as long as the process.

    Args:
        path: A file, existing or to be written; or a URL.
    """
    name = os.fspath(path)
    try:
        name.encode("utf-8")
    except UnicodeEncodeError:
        return _link(str(Path(name).absolute()), Path(name).suffix)
    return name


@lru_cache(maxsize=256)
def _link(target: str, suffix: str) -> str:
    folder = Path(tempfile.mkdtemp(prefix="visup-names-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    plain = suffix if suffix.isascii() else ""
    link = folder / f"file{plain}"
    link.symlink_to(target)
    return str(link)

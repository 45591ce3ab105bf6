"""Digests of code and of the files of a sequence, as cache keys."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from functools import cache
from importlib import resources
from pathlib import Path

from visup.evaluation.motion.runner import LabelledSequence


@cache
def code_digest(folders: tuple[str, ...]) -> bytes:
    """A digest of files and folders of the package, with their code and data; made once per process."""
    digest = hashlib.sha256()
    package = Path(str(resources.files("visup")))
    for folder in folders:
        for file in [package / folder, *sorted((package / folder).rglob("*"))]:
            if file.is_file() and file.parent.name != "__pycache__":
                digest.update(file.read_bytes())
    return digest.digest()


def files_digest(sequence: LabelledSequence) -> bytes:
    """A digest of the names, sizes and times of a sequence's files."""
    digest = hashlib.sha256()
    for file in (*_files(sequence.source), *sequence.masks.values()):
        state = file.stat()
        digest.update(f"{file.name} {state.st_size} {state.st_mtime_ns}\n".encode())
    return digest.digest()


def _files(source: Path) -> Iterable[Path]:
    return sorted(source.iterdir()) if source.is_dir() else [source]

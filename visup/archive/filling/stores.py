"""Clips in object stores and on servers that fsspec can read; each is copied to its worker.

The store's own identity of a file (an entity tag, or size and time) replaces a hash of its content, so that
ten thousand clips are planned without being read.
"""

from __future__ import annotations

import hashlib
import re
import shutil
from collections.abc import Iterator
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path, PurePosixPath
from typing import Any

from visup.agent.model.errors import SourceError
from visup.agent.storage.journal import Journal
from visup.agent.storage.journal_reader import JOURNAL
from visup.agent.storage.jsonable import to_jsonable
from visup.archive.extra import imported
from visup.percepts.video.image_folder import VIDEO_SUFFIXES
from visup.runs.settings import WatchSettings

_URL = re.compile(r"[A-Za-z][A-Za-z0-9+.-]+://")
FETCHED = "source"


@dataclass(frozen=True, slots=True)
class StoredFile:
    """A file in a store.

    Attributes:
        url: Its URL.
        mark: Identity of its content as given by the store.
        bytes: Its size.
        modified: Time of its last change, seconds since the epoch, or None.
    """

    url: str
    mark: str
    bytes: int
    modified: float | None

    def __str__(self) -> str:
        return self.url

    @property
    def content_hash(self) -> str:
        """SHA-256 of its URL and the store's mark."""
        return hashlib.sha256(f"{self.url}\n{self.mark}".encode()).hexdigest()


def is_url(word: str) -> bool:
    """Whether a word is a URL."""
    return _URL.match(word) is not None


def stored_clips(word: str) -> list[StoredFile]:
    """The clips that a URL names: a file, a folder (recursively), or a pattern.

    Raises:
        SourceError: The store cannot be read, or no clip is found.
        ExtraMissingError: fsspec is not installed.
    """
    fsspec = imported("fsspec")
    try:
        store, path = fsspec.core.url_to_fs(word)
        found = [_file(store, store.unstrip_protocol(p)) for p in _paths(store, path)]
    except Exception as fault:  # store libraries raise any type, and may be missing
        raise _unreadable(word, fault) from fault
    if not found:
        raise SourceError(
            "no clip is found here", where=word, expected="a video, or a folder of some"
        )
    return found


def fetched(settings: WatchSettings, folder: Path) -> WatchSettings:
    """Settings whose source is local: a file in a store is replaced by a copy.

    Args:
        settings: Settings of a run.
        folder: Folder for copies.

    Raises:
        SourceError: It cannot be copied.
    """
    if not is_url(settings.source):
        return settings
    place = folder / FETCHED / PurePosixPath(settings.source).name
    try:
        place.parent.mkdir(parents=True, exist_ok=True)
        with imported("fsspec").open(settings.source, "rb") as remote, place.open("wb") as local:
            shutil.copyfileobj(remote, local)
    except Exception as fault:
        raise _unreadable(settings.source, fault) from fault
    return replace(settings, source=str(place))


def note_source(folder: Path, settings: WatchSettings) -> None:
    """Record the original source of a run in place of the local copy."""
    journal = Journal(folder / JOURNAL, resume=True)
    try:
        journal.note(source=settings.source, settings=to_jsonable(settings))
    finally:
        journal.close()


def _paths(store: Any, path: str) -> Iterator[str]:
    if any(c in path for c in "*?["):
        yield from (p for p in sorted(store.glob(path)) if _is_video(p))
    elif store.isdir(path):
        yield from (p for p in sorted(store.find(path)) if _is_video(p))
    else:
        yield path


def _is_video(path: str) -> bool:
    return PurePosixPath(path).suffix.lower() in VIDEO_SUFFIXES


def _file(store: Any, url: str) -> StoredFile:
    info = store.info(url)
    times = [info[k] for k in ("LastModified", "last_modified", "mtime", "created") if info.get(k)]
    when = times[0] if times else None
    seconds = when.timestamp() if isinstance(when, datetime) else when
    modified = float(seconds) if isinstance(seconds, int | float) else None
    mark = str(info.get("ETag") or store.ukey(url))
    return StoredFile(url, mark, int(info.get("size") or 0), modified)


def _unreadable(where: str, fault: Exception) -> SourceError:
    if isinstance(fault, SourceError):
        return fault
    hint = (
        "install what the store needs: pip install s3fs" if isinstance(fault, ImportError) else None
    )
    reason = str(fault) or type(fault).__name__
    return SourceError(f"it cannot be read ({reason})", where=where, hint=hint)

"""What a command calls a lake: a folder, or the address of one in a store with a copy here."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from visup.agent.model.errors import OutputError
from visup.archive.filling.stores import is_url
from visup.archive.filling.watching import ClipOutcome
from visup.archive.joining.compacting import compact_if_worth_it
from visup.archive.lake import MARK, Lake
from visup.archive.storing.lake_store import LakeStore


def store_of(place: str) -> LakeStore | None:
    """The store that is meant, or None for a folder."""
    return LakeStore(place.rstrip("/")) if is_url(place) else None


def copy_of(place: str) -> Path:
    """The folder of a lake: itself, or where the copy of a lake in a store is kept."""
    if not is_url(place):
        return Path(place)
    caches = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    return caches / "visup" / "lakes" / hashlib.sha256(place.rstrip("/").encode()).hexdigest()[:16]


def is_lake(place: str) -> bool:
    """Whether there is a lake.

    Raises:
        OutputError: The store cannot be read.
    """
    store = store_of(place)
    return store.exists() if store else (Path(place) / MARK).exists()


def open_lake(place: str) -> Lake:
    """A lake that there is; the copy of one in a store is brought up to date.

    Raises:
        OutputError: There is none, it is of another version, or the store cannot be reached.
    """
    store = store_of(place)
    if store is None:
        return Lake.open(Path(place))
    if not store.exists():
        raise OutputError(
            "there is no lake here", where=place, hint=f"visup archive run CLIPS... --into {place}"
        )
    return _pulled(store, copy_of(place))


def create_lake(place: str) -> Lake:
    """A lake that there is, or a new one.

    Raises:
        OutputError: The folder holds something else, or cannot be written; or the store.
    """
    store, copy = store_of(place), copy_of(place)
    if store is None:
        return Lake.create(copy)
    if store.exists():
        return _pulled(store, copy)
    lake = Lake.create(copy)
    store.push(lake)
    return Lake(lake.path, store.fetch)


def _pulled(store: LakeStore, copy: Path) -> Lake:
    copy.mkdir(parents=True, exist_ok=True)
    store.pull(copy)
    return Lake(Lake.open(copy).path, store.fetch)


def settle(lake: Lake, store: LakeStore | None) -> None:
    """What is done once a lake is filled: files are joined where that is worth it, and all is in the store.

    Raises:
        OutputError: It cannot be written.
    """
    compact_if_worth_it(lake)
    if store:
        store.push(lake)


def pushed(
    store: LakeStore | None, lake: Lake, tell: Callable[[ClipOutcome], None]
) -> Callable[[ClipOutcome], None]:
    """What is told of each clip, once its run is in the store.

    A store that cannot be reached stops nobody: the run is here, and goes there with the next `push`.
    """
    if store is None:
        return tell

    def told(outcome: ClipOutcome) -> None:
        if not outcome.failure:
            with suppress(OutputError):
                store.push_run(lake, outcome.run)
        tell(outcome)

    return told

"""How commands name a lake: a local folder, or the URL of one in a store, of which there is a local copy."""

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
    """The store of a URL, or None for a folder."""
    return LakeStore(place.rstrip("/")) if is_url(place) else None


def copy_of(place: str) -> Path:
    """The local folder of a lake, or of the copy of a lake in a store."""
    if not is_url(place):
        return Path(place)
    caches = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    return caches / "visup" / "lakes" / hashlib.sha256(place.rstrip("/").encode()).hexdigest()[:16]


def is_lake(place: str) -> bool:
    """Whether the lake exists.

    Raises:
        OutputError: The store cannot be read.
    """
    store = store_of(place)
    return store.exists() if store else (Path(place) / MARK).exists()


def open_lake(place: str) -> Lake:
    """Open an existing lake; the copy of one in a store is updated.

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
    """Open a lake, or create one.

    Raises:
        OutputError: The folder or the store holds something else or cannot be written.
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
    """Finish filling: compact the lake if it is worth it, and upload everything to its store.

    Raises:
        OutputError: It cannot be written.
    """
    compact_if_worth_it(lake)
    if store:
        store.push(lake)


def pushed(
    store: LakeStore | None, lake: Lake, on_outcome: Callable[[ClipOutcome], None]
) -> Callable[[ClipOutcome], None]:
    """Wrap `on_outcome` to upload each run first.

    An unreachable store stops nothing: the run is committed locally and is uploaded with the next `push`.
    """
    if store is None:
        return on_outcome

    def push_and_report(outcome: ClipOutcome) -> None:
        if not outcome.failure:
            with suppress(OutputError):
                store.push_run(lake, outcome.run)
        on_outcome(outcome)

    return push_and_report

"""Shared state of all pages: the library and the open runs."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from pathlib import Path
from threading import Lock
from typing import TypeVar

from visup.agent.model.errors import ErrorGroup, OutputError, SourceLocation, VisupError
from visup.agent.storage.journal_reader import JOURNAL
from visup.console.library import RunLibrary
from visup.console.reasoning.inquiry import Inquiry
from visup.console.run_view import RunView

MAX_VIEWS = 16
MAX_INQUIRIES = 4
"""Inquiries hold all minds of a run, so only a few are cached."""

Cached = TypeVar("Cached")
RunIdentity = tuple[str, int]
"""A folder and the inode of its journal: another run may replace a deleted one."""


class ConsoleState:
    """The library and the open runs; thread-safe.

    Args:
        library: Finds runs.
        save_to: Folder in which operators may save texts; None for none.
    """

    def __init__(self, library: RunLibrary, save_to: Path | None = None) -> None:
        self.library, self.save_to = library, save_to
        self._views: OrderedDict[RunIdentity, RunView] = OrderedDict()
        self._inquiries: OrderedDict[RunIdentity, Inquiry] = OrderedDict()
        self._lock, self._inquiry_lock = Lock(), Lock()

    def view(self, key: str, *, refresh: bool = False) -> RunView:
        """The view of a run.

        Args:
            key: Key of the run.
            refresh: Whether to read on if it has grown.

        Raises:
            OutputError: There is no such run, or it cannot be read.
        """
        with self._lock:
            folder = self.library.folder(key)
            identity = _identity(folder)
            view = _cached(self._views, identity, lambda: RunView(folder), MAX_VIEWS)
            if refresh:
                view = self._views[identity] = view.refreshed()
            return view

    def inquiry(self, key: str) -> Inquiry:
        """The inquiry of a run.

        Raises:
            VisupError: There is no such run, or its reasoning cannot be replayed.
        """
        with self._lock:
            folder = self.library.folder(key)
        with self._inquiry_lock:  # loads tasks, rules and models without blocking other pages
            return _cached(
                self._inquiries, _identity(folder), lambda: _open_inquiry(folder), MAX_INQUIRIES
            )


def _open_inquiry(folder: Path) -> Inquiry:
    """The inquiry of a run; errors quote no line of files named only by its folder.

    A folder from a stranger may name any file as its task.
    """
    try:
        return Inquiry(folder)
    except VisupError as fault:
        if not isinstance(fault, ErrorGroup) and not isinstance(fault.where, SourceLocation):
            raise
    what = "a file of tasks, rules or zones that the run names is not as it should be"
    raise OutputError(what, where=folder.name, hint="`visup task check FILE` tells what is wrong")


def _identity(folder: Path) -> RunIdentity:
    try:
        return str(folder), (folder / JOURNAL).stat().st_ino
    except OSError:
        return str(folder), 0


def _cached(
    cache: OrderedDict[RunIdentity, Cached],
    key: RunIdentity,
    make: Callable[[], Cached],
    max_size: int,
) -> Cached:
    """An entry of an LRU cache, created if missing; the least recently used are evicted."""
    if key not in cache:
        cache[key] = make()
    cache.move_to_end(key)
    while len(cache) > max_size:
        cache.popitem(last=False)
    return cache[key]

"""What all pages share: the library, and the runs that are open."""

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

MOST_VIEWS = 16
MOST_INQUIRIES = 4
"""Inquiries hold all minds of a run, so few are kept."""

Kept = TypeVar("Kept")
RunIdentity = tuple[str, int]
"""A folder, and which file its journal is: another run may take the place of one that was deleted."""


class ConsoleState:
    """The library, and the runs that are open; safe for many pages at once.

    Args:
        library: Finds runs.
        save_to: Folder into which operators may save what they write; None for nowhere.
    """

    def __init__(self, library: RunLibrary, save_to: Path | None = None) -> None:
        self.library, self.save_to = library, save_to
        self._views: OrderedDict[RunIdentity, RunView] = OrderedDict()
        self._inquiries: OrderedDict[RunIdentity, Inquiry] = OrderedDict()
        self._lock, self._asking = Lock(), Lock()

    def view(self, key: str, *, refresh: bool = False) -> RunView:
        """A run as it is read.

        Args:
            key: Of the run.
            refresh: Whether to read on in a run that has grown.

        Raises:
            OutputError: There is no such run, or it cannot be read.
        """
        with self._lock:
            folder = self.library.folder(key)
            which = _identity(folder)
            made = _kept(self._views, which, lambda: RunView(folder), MOST_VIEWS)
            if refresh:
                made = self._views[which] = made.refreshed()
            return made

    def inquiry(self, key: str) -> Inquiry:
        """What answers questions about a run.

        Raises:
            VisupError: There is no such run, or it cannot be reasoned about again.
        """
        with self._lock:
            folder = self.library.folder(key)
        with self._asking:  # tasks, rules and models are loaded: other pages need not wait for that
            return _kept(
                self._inquiries, _identity(folder), lambda: _opened(folder), MOST_INQUIRIES
            )


def _opened(folder: Path) -> Inquiry:
    """What answers questions about a run; no line is quoted of a file that only its folder names.

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


def _kept(
    held: OrderedDict[RunIdentity, Kept], key: RunIdentity, make: Callable[[], Kept], most: int
) -> Kept:
    """What is held under a key, made when it is not there; the ones used longest ago go."""
    if key not in held:
        held[key] = make()
    held.move_to_end(key)
    while len(held) > most:
        held.popitem(last=False)
    return held[key]

"""What all pages share: the library, and the runs that are open."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from pathlib import Path
from threading import Lock
from typing import TypeVar

from visup.agent.model.errors import ErrorGroup, OutputError, SourceLocation, VisupError
from visup.console.library import RunLibrary
from visup.console.reasoning.inquiry import Inquiry
from visup.console.run_view import RunView

MOST_VIEWS = 16
MOST_INQUIRIES = 4
"""Inquiries hold all minds of a run, so few are kept."""

Kept = TypeVar("Kept")


class ConsoleState:
    """The library, and the runs that are open; safe for many pages at once.

    Args:
        library: Finds runs.
        save_to: Folder into which operators may save what they write; None for nowhere.
    """

    def __init__(self, library: RunLibrary, save_to: Path | None = None) -> None:
        self.library, self.save_to = library, save_to
        self._views: OrderedDict[str, RunView] = OrderedDict()
        self._inquiries: OrderedDict[str, Inquiry] = OrderedDict()
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
            made = _kept(self._views, key, lambda: RunView(self.library.folder(key)), MOST_VIEWS)
            if refresh:
                made = self._views[key] = made.refreshed()
            return made

    def inquiry(self, key: str) -> Inquiry:
        """What answers questions about a run.

        Raises:
            VisupError: There is no such run, or it cannot be reasoned about again.
        """
        with self._lock:
            folder = self.library.folder(key)
        with self._asking:  # tasks, rules and models are loaded: other pages need not wait for that
            return _kept(self._inquiries, key, lambda: _opened(folder), MOST_INQUIRIES)


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


def _kept(held: OrderedDict[str, Kept], key: str, make: Callable[[], Kept], most: int) -> Kept:
    """What is held under a key, made when it is not there; the ones used longest ago go."""
    if key not in held:
        held[key] = make()
    held.move_to_end(key)
    while len(held) > most:
        held.popitem(last=False)
    return held[key]

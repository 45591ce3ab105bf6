"""Finds the runs that a console shows, only below the given folders."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from visup.agent.model.errors import OutputError, VisupError
from visup.agent.storage.journal_reader import JOURNAL, Recording, is_run

MAX_DEPTH = 6
"""Search depth below the given folders."""

MAX_RUNS = 10_000
KEY_LENGTH = 16


@dataclass(frozen=True, slots=True)
class RunEntry:
    """A run in the list.

    Attributes:
        key: Key of the run in URLs, so that they contain no path.
        folder: Folder of the run.
        source: The source as named; empty if not known.
        camera: Name of the camera, for runs of a service.
        tasks: Names of its tasks.
        verdict: Verdict of the journal; None while the run goes on, or without a task.
        alerts: Number of alerts opened.
        seconds: From its first step to its last.
        written: When it was last written to, seconds since the epoch.
        ended: Whether it has ended.
        problem: Why it cannot be read, or empty.
    """

    key: str
    folder: Path
    source: str = ""
    camera: str = ""
    tasks: tuple[str, ...] = ()
    verdict: str | None = None
    alerts: int = 0
    seconds: float = 0.0
    written: float = 0.0
    ended: bool = False
    problem: str = ""

    @property
    def name(self) -> str:
        """Its name in the list."""
        return self.folder.name


@dataclass(slots=True)
class RunLibrary:
    """The runs below some folders.

    Args:
        roots: Run folders, or folders of run folders.

    Raises:
        OutputError: A folder does not exist or contains no run.
    """

    roots: Sequence[Path]
    _known: dict[str, Path] = field(default_factory=dict)
    _ended_entries: dict[str, RunEntry] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for root in self.roots:
            if not root.is_dir():
                raise OutputError(
                    "there is no such folder",
                    where=str(root),
                    expected="a run folder, or a folder of them",
                )
        self.scan()

    def scan(self) -> tuple[RunEntry, ...]:
        """All present runs, latest first; new ones become known by their keys."""
        self._known = {run_key(run): run for root in self.roots for run in _runs_below(root)}
        found = [self._entry(key, run) for key, run in self._known.items()]
        return tuple(sorted(found, key=lambda e: (-e.written, e.name)))

    def _entry(self, key: str, run: Path) -> RunEntry:
        """The list entry of a run; an ended run is read again only if it was written to."""
        cached = self._ended_entries.get(key)
        if cached is not None and cached.written == _written(run):
            return cached
        entry = entry_of(key, run)
        if entry.ended:
            self._ended_entries[key] = entry
        return entry

    def folder(self, key: str) -> Path:
        """The folder of a run.

        Raises:
            OutputError: No run of that key is known.
        """
        if key not in self._known:
            self.scan()
        try:
            return self._known[key]
        except KeyError:
            raise OutputError(
                "this run is not there any more", hint="go back to the list of runs"
            ) from None


def _written(run: Path) -> float | None:
    try:
        return Recording(run / JOURNAL).written()
    except (VisupError, OSError):
        return None


def run_key(folder: Path) -> str:
    """The key of a run in URLs."""
    name = os.fsencode(folder.resolve())
    return hashlib.sha256(name).hexdigest()[:KEY_LENGTH]


def _runs_below(root: Path) -> Iterator[Path]:
    """Run folders, without following links out of the folder."""
    count = 0
    for path, folders, names in os.walk(root):
        folder = Path(path)
        if JOURNAL in names and is_run(folder):
            count += 1
            yield folder
        depth = len(folder.relative_to(root).parts)
        folders[:] = sorted(folders) if depth < MAX_DEPTH and count < MAX_RUNS else []


def entry_of(key: str, folder: Path) -> RunEntry:
    """The list entry of a run; for an unreadable one, with the reason."""
    try:
        recording = Recording.open(folder)
        facts, ends = recording.facts(), recording.first_and_last()
        first, last = (recording.summary_at(i)["time"] for i in ends) if ends else (0.0, 0.0)
        return RunEntry(
            key,
            folder,
            source=_text(facts.get("source")),
            camera=_text(facts.get("camera")),
            tasks=_tasks(facts),
            verdict=_text(facts.get("verdict")) or None,
            alerts=len(recording.alerts()),
            seconds=float(last) - float(first),
            written=recording.written(),
            ended="ended" in facts,
        )
    except (VisupError, OSError) as fault:
        return RunEntry(key, folder, problem=str(fault))


def _tasks(facts: Mapping[str, Any]) -> tuple[str, ...]:
    settings = facts.get("settings")
    tasks = settings.get("tasks") if isinstance(settings, Mapping) else None
    names = tasks if isinstance(tasks, list) else []
    return tuple(Path(t).stem for t in names if isinstance(t, str))


def _text(value: object) -> str:
    return value if isinstance(value, str) else ""

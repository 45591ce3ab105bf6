"""The runs that a console shows: found below the folders it was given, and nowhere else."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from visup.agent.model.errors import OutputError, VisupError
from visup.agent.storage.journal_reader import JOURNAL, Recording, is_run

DEEPEST = 6
"""Folders below the given ones that are looked into."""

MOST_RUNS = 10_000
KEY_LETTERS = 16


@dataclass(frozen=True, slots=True)
class RunEntry:
    """A run in the list.

    Attributes:
        key: Stands for the run in addresses, which so never hold a path.
        folder: Of the run.
        source: What was watched, as it was named; empty where that is not known.
        camera: Name of the camera, for runs of a service.
        tasks: Names of its tasks.
        verdict: As in the journal; None while it goes on, or where nothing was judged.
        alerts: How many were opened.
        seconds: From its first step to its last one.
        written: When it was last written to, seconds since the epoch.
        ended: Whether it is over.
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
        """What it is called in the list."""
        return self.folder.name


@dataclass(slots=True)
class RunLibrary:
    """The runs below some folders.

    Args:
        places: Run folders, or folders of run folders.

    Raises:
        OutputError: A place is not there, or holds no run.
    """

    places: Sequence[Path]
    _known: dict[str, Path] = field(default_factory=dict)
    _over: dict[str, RunEntry] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for place in self.places:
            if not place.is_dir():
                raise OutputError(
                    "there is no such folder",
                    where=str(place),
                    expected="a run folder, or a folder of them",
                )
        self.scan()

    def scan(self) -> tuple[RunEntry, ...]:
        """All runs there are now, the latest first; a new one is known from then on."""
        self._known = {run_key(run): run for place in self.places for run in _runs_below(place)}
        found = [self._entry(key, run) for key, run in self._known.items()]
        return tuple(sorted(found, key=lambda e: (-e.written, e.name)))

    def _entry(self, key: str, run: Path) -> RunEntry:
        """What the list says of a run; one that is over is read again only when it was written to."""
        held = self._over.get(key)
        if held is not None and held.written == _written(run):
            return held
        entry = entry_of(key, run)
        if entry.ended:
            self._over[key] = entry
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
    return hashlib.sha256(name).hexdigest()[:KEY_LETTERS]


def _runs_below(place: Path) -> Iterator[Path]:
    """Run folders, without following links out of the place."""
    found = 0
    for at, folders, names in os.walk(place):
        folder = Path(at)
        if JOURNAL in names and is_run(folder):
            found += 1
            yield folder
        deep = len(folder.relative_to(place).parts)
        folders[:] = sorted(folders) if deep < DEEPEST and found < MOST_RUNS else []


def entry_of(key: str, folder: Path) -> RunEntry:
    """What the list says of one run; of an unreadable one, why it is."""
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
    named = tasks if isinstance(tasks, list) else []
    return tuple(Path(t).stem for t in named if isinstance(t, str))


def _text(value: object) -> str:
    return value if isinstance(value, str) else ""

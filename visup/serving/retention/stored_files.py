"""The content of a store: runs, and the evidence of each alert in them."""

from __future__ import annotations

import shutil
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from visup.agent.storage.journal_reader import JOURNAL
from visup.runs.evidence.keeper import EVIDENCE
from visup.serving.run_store import is_run_name


@dataclass(frozen=True, slots=True)
class StoredEvidence:
    """The files of one alert: picture, clip and record.

    Attributes:
        files: Paths.
        size: Bytes.
        written: When the last of them was written, seconds since 1970.
    """

    files: tuple[Path, ...]
    size: int
    written: float


@dataclass(frozen=True, slots=True)
class StoredRun:
    """A run in the store.

    Attributes:
        folder: Folder of the run.
        size: Bytes without evidence.
        written: When it was last written to, seconds since 1970.
        active: Whether it is active.
        evidence: Evidence of its alerts, oldest first.
    """

    folder: Path
    size: int
    written: float
    active: bool
    evidence: tuple[StoredEvidence, ...] = ()


@dataclass(frozen=True, slots=True)
class StoredFiles:
    """The content of a store.

    Attributes:
        runs: Runs of all cameras.
        free: Free bytes on its disk.
    """

    runs: tuple[StoredRun, ...]
    free: int

    @property
    def evidence_size(self) -> int:
        """Bytes of all evidence."""
        return sum(e.size for run in self.runs for e in run.evidence)

    @property
    def size(self) -> int:
        """Bytes of everything."""
        return self.evidence_size + sum(run.size for run in self.runs)


def scan_store(store: Path, active_runs: Iterable[Path]) -> StoredFiles:
    """Scan a store; files that vanish meanwhile are left out.

    Args:
        store: Folder of all runs.
        active_runs: Folders of the active runs.
    """
    active = set(active_runs)
    folders = sorted(p for p in store.glob("*/*") if is_run_name(p.name) and _is_plain_folder(p))
    runs = tuple(_run(folder, active=folder in active) for folder in folders)
    return StoredFiles(runs, shutil.disk_usage(store).free)


def _is_plain_folder(path: Path) -> bool:
    """A folder that is no symbolic link: the target of a link does not belong to the store."""
    return path.is_dir() and not path.is_symlink()


def _run(folder: Path, *, active: bool) -> StoredRun:
    run_files = [entries for p in folder.iterdir() if p.name != EVIDENCE for entries in _sizes([p])]
    evidence = folder / EVIDENCE
    alerts = tuple(_evidence(evidence)) if _is_plain_folder(evidence) else ()
    journal = folder / JOURNAL
    written = max(
        (at for _, at in run_files), default=max((e.written for e in alerts), default=0.0)
    )
    with suppress(OSError):
        written = written or journal.stat().st_mtime
    return StoredRun(folder, sum(size for size, _ in run_files), written, active, alerts)


def _evidence(folder: Path) -> Iterator[StoredEvidence]:
    """Evidence by alert: files whose names differ only in their suffixes belong together."""
    by_stem: dict[str, list[Path]] = {}
    for path in folder.iterdir():
        by_stem.setdefault(path.name.lstrip(".").partition(".")[0], []).append(path)
    found = []
    for files in by_stem.values():
        entries = _sizes(files)
        if entries:
            size, written = sum(s for s, _ in entries), max(at for _, at in entries)
            found.append(StoredEvidence(tuple(sorted(files)), size, written))
    yield from sorted(found, key=lambda e: (e.written, e.files))


def _sizes(paths: Sequence[Path]) -> list[tuple[int, float]]:
    """Size and time of each existing file; for a folder, of all files in it."""
    found = []
    for path in paths:
        with suppress(OSError):
            if _is_plain_folder(path):
                found += _sizes(list(path.iterdir()))
            else:
                status = path.lstat()
                found.append((status.st_size, status.st_mtime))
    return found

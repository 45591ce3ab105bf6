"""Applies the retention rules to a store at intervals, in a thread, so that a slow disk blocks no camera."""

from __future__ import annotations

import shutil
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from pathlib import Path

from visup.runs.evidence.keeper import EVIDENCE
from visup.serving.room.retention import Removal, RemovalReason, removals
from visup.serving.room.stored import StoredFiles, StoredRun, look_into
from visup.serving.site.records import RetentionLimits
from visup.serving.site_log import SITE, SiteEvent, Tell

SCAN_S = 10.0
"""Seconds between two scans, in which the cameras of a site write some megabytes."""

WHY = {
    RemovalReason.AGE: "they were older than is to be kept",
    RemovalReason.STORE: "the store was larger than it may be",
    RemovalReason.DISK: "the disk was nearly full",
}


class Housekeeper:
    """Deletes what exceeds the retention limits.

    Args:
        store: Folder of all runs.
        limits: The retention limits; replaced when the site file changes.
        tell: Receives the events.
        now: Seconds since 1970.

    Attributes:
        limits: As given.
        room: Bytes of the store by kind at the last scan.
        deleted: Counts of the runs, and of the alerts whose evidence was deleted.
    """

    def __init__(
        self,
        store: Path,
        limits: RetentionLimits,
        tell: Tell,
        now: Callable[[], float] = time.time,
    ) -> None:
        self.limits = limits
        self.room: Mapping[str, float] = {}
        self.deleted: Counter[str] = Counter({"runs": 0, EVIDENCE: 0})
        self._store, self._tell, self._now = store, tell, now
        self._scanned_at: float | None = None
        self._full = False
        self._thread: threading.Thread | None = None

    def turn(self, now: float, going_on: Iterable[Path]) -> None:
        """Start a scan if one is due and none is running; returns at once.

        Args:
            now: Seconds of a monotonic clock.
            going_on: Folders of the runs that are under way.
        """
        busy = self._thread is not None and self._thread.is_alive()
        if busy or (self._scanned_at is not None and now - self._scanned_at < SCAN_S):
            return
        self._scanned_at = now
        under_way = tuple(going_on)
        self._thread = threading.Thread(
            target=self._scan_in_thread, args=(under_way,), name="housekeeper", daemon=True
        )
        self._thread.start()

    def look(self, going_on: Iterable[Path]) -> None:
        """Scan the store and delete what exceeds the limits.

        Args:
            going_on: Folders of the runs that are under way.

        Raises:
            OSError: The store cannot be read.
        """
        files = look_into(self._store, going_on)
        gone = removals(files, self.limits, self._now())
        for one in gone:
            _remove(one)
        self._note(files, gone)
        self._report_deleted(gone)
        self._report_if_full(files.free + sum(one.size for one in gone))

    def _scan_in_thread(self, going_on: Iterable[Path]) -> None:
        with suppress(OSError):  # the store may return; if not, its cameras report it
            self.look(going_on)

    def _note(self, files: StoredFiles, gone: tuple[Removal, ...]) -> None:
        self.room = {
            "free": float(files.free),
            "runs": float(files.size - files.evidence_size),
            EVIDENCE: float(files.evidence_size),
        }
        self.deleted.update(_kind(one) for one in gone)

    def _report_deleted(self, gone: tuple[Removal, ...]) -> None:
        for why in RemovalReason:
            counts = Counter(_kind(one) for one in gone if one.why is why)
            if counts:
                freed = sum(one.size for one in gone if one.why is why) / 1e6
                text = f"deleted {_listed(counts)} ({freed:.1f} MB): {WHY[why]}"
                kind = SiteEvent.NO_ROOM if why is RemovalReason.DISK else SiteEvent.DELETED
                self._tell(SITE, text, kind, why=why.value, freed_bytes=round(freed * 1e6))

    def _report_if_full(self, free: float) -> None:
        """Warn when nothing more can be deleted, once until there is space again."""
        full = free < self.limits.free_bytes
        if full and not self._full:
            text = (
                f"the disk has {free / 1e9:.1f} GB left, and nothing more can be deleted: make room"
            )
            self._tell(SITE, text, SiteEvent.NO_ROOM, free_bytes=round(free))
        self._full = full


def _kind(one: Removal) -> str:
    return "runs" if isinstance(one.what, StoredRun) else EVIDENCE


def _listed(counts: Mapping[str, int]) -> str:
    runs, alerts = counts.get("runs", 0), counts.get(EVIDENCE, 0)
    parts = [f"{runs} {'run' if runs == 1 else 'runs'}"] if runs else []
    parts += [f"the evidence of {alerts} {'alert' if alerts == 1 else 'alerts'}"] if alerts else []
    return " and ".join(parts)


def _remove(one: Removal) -> None:
    """Delete it; a file that cannot be deleted is tried again at the next scan."""
    if isinstance(one.what, StoredRun):
        folder = one.what.folder
        others = [p for p in folder.iterdir() if p.name != EVIDENCE] if folder.is_dir() else []
        _delete(others)
    else:
        folder = one.what.files[0].parent.parent
        _delete(one.what.files)
    for empty in (folder / EVIDENCE, folder):
        with suppress(OSError):  # not empty
            empty.rmdir()


def _delete(paths: Iterable[Path]) -> None:
    for path in paths:
        with suppress(OSError):
            if path.is_dir() and not path.is_symlink():
                shutil.rmtree(path, ignore_errors=True)
            else:
                path.unlink(missing_ok=True)

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
from visup.serving.retention.removals import Removal, RemovalReason, removals
from visup.serving.retention.stored_files import StoredFiles, StoredRun, scan_store
from visup.serving.site.records import RetentionLimits
from visup.serving.site_log import SITE, LogEvent, SiteEvent

SCAN_S = 10.0
"""Seconds between two scans, in which the cameras of a site write some megabytes."""

REASON_TEXTS = {
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
        log_event: LogEvent,
        now: Callable[[], float] = time.time,
    ) -> None:
        self.limits = limits
        self.disk_usage: Mapping[str, float] = {}
        self.deleted: Counter[str] = Counter({"runs": 0, EVIDENCE: 0})
        self._store, self._log_event, self._now = store, log_event, now
        self._scanned_at: float | None = None
        self._disk_full = False
        self._thread: threading.Thread | None = None

    def tick(self, now: float, active_runs: Iterable[Path]) -> None:
        """Start a scan if one is due and none is running; returns at once.

        Args:
            now: Seconds of a monotonic clock.
            active_runs: Folders of the runs that are under way.
        """
        scanning = self._thread is not None and self._thread.is_alive()
        if scanning or (self._scanned_at is not None and now - self._scanned_at < SCAN_S):
            return
        self._scanned_at = now
        runs = tuple(active_runs)
        self._thread = threading.Thread(
            target=self._scan_in_thread, args=(runs,), name="housekeeper", daemon=True
        )
        self._thread.start()

    def scan(self, active_runs: Iterable[Path]) -> None:
        """Scan the store and delete what exceeds the limits.

        Args:
            active_runs: Folders of the runs that are under way.

        Raises:
            OSError: The store cannot be read.
        """
        files = scan_store(self._store, active_runs)
        removed = removals(files, self.limits, self._now())
        for removal in removed:
            _remove(removal)
        self._record(files, removed)
        self._report_deleted(removed)
        self._report_if_full(files.free + sum(removal.size for removal in removed))

    def _scan_in_thread(self, active_runs: Iterable[Path]) -> None:
        with suppress(OSError):  # the store may return; if not, its cameras report it
            self.scan(active_runs)

    def _record(self, files: StoredFiles, removed: tuple[Removal, ...]) -> None:
        self.disk_usage = {
            "free": float(files.free),
            "runs": float(files.size - files.evidence_size),
            EVIDENCE: float(files.evidence_size),
        }
        self.deleted.update(_kind(removal) for removal in removed)

    def _report_deleted(self, removed: tuple[Removal, ...]) -> None:
        for reason in RemovalReason:
            counts = Counter(_kind(removal) for removal in removed if removal.reason is reason)
            if counts:
                freed = sum(removal.size for removal in removed if removal.reason is reason) / 1e6
                text = f"deleted {_listed(counts)} ({freed:.1f} MB): {REASON_TEXTS[reason]}"
                kind = SiteEvent.NO_ROOM if reason is RemovalReason.DISK else SiteEvent.DELETED
                self._log_event(
                    SITE, text, kind, reason=reason.value, freed_bytes=round(freed * 1e6)
                )

    def _report_if_full(self, free: float) -> None:
        """Warn when nothing more can be deleted, once until there is space again."""
        full = free < self.limits.free_bytes
        if full and not self._disk_full:
            text = (
                f"the disk has {free / 1e9:.1f} GB left, and nothing more can be deleted: make room"
            )
            self._log_event(SITE, text, SiteEvent.NO_ROOM, free_bytes=round(free))
        self._disk_full = full


def _kind(removal: Removal) -> str:
    return "runs" if isinstance(removal.what, StoredRun) else EVIDENCE


def _listed(counts: Mapping[str, int]) -> str:
    runs, alerts = counts.get("runs", 0), counts.get(EVIDENCE, 0)
    parts = [f"{runs} {'run' if runs == 1 else 'runs'}"] if runs else []
    parts += [f"the evidence of {alerts} {'alert' if alerts == 1 else 'alerts'}"] if alerts else []
    return " and ".join(parts)


def _remove(removal: Removal) -> None:
    """Delete it; a file that cannot be deleted is tried again at the next scan."""
    if isinstance(removal.what, StoredRun):
        folder = removal.what.folder
        others = [p for p in folder.iterdir() if p.name != EVIDENCE] if folder.is_dir() else []
        _delete(others)
    else:
        folder = removal.what.files[0].parent.parent
        _delete(removal.what.files)
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

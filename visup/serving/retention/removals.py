"""What to delete from a store, by age, by the size limit of the store, and by the free space of the disk.

Three rules, in this order: what is too old is deleted; if the store is too large the oldest runs are deleted,
then the evidence of alerts; if the disk is full evidence goes first, because a camera resumes from its
journal. The journal of an active run is never deleted.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum

from visup.serving.retention.stored_files import StoredEvidence, StoredFiles, StoredRun
from visup.serving.site.records import RetentionLimits

DAY_S = 86400.0
RECENT_S = 120.0
"""Runs written within this time are kept: they may have just begun or be closing. So is evidence, except by
age: someone may still be looking at a recent alert."""

FREE_SPACE_FACTOR = 1.1
"""A full disk is freed beyond its limit by this factor, so that the next scan does not find it full again."""


class RemovalReason(StrEnum):
    """The rule by which something is deleted."""

    AGE = "age"
    STORE = "store"
    DISK = "disk"


@dataclass(frozen=True, slots=True)
class Removal:
    """Something to delete.

    Attributes:
        what: A run without its evidence, or the evidence of an alert.
        reason: The rule.
    """

    what: StoredRun | StoredEvidence
    reason: RemovalReason

    @property
    def size(self) -> int:
        """Bytes that it frees."""
        return self.what.size


def removals(files: StoredFiles, limits: RetentionLimits, now: float) -> tuple[Removal, ...]:
    """What to delete, in this order.

    Args:
        files: The content of the store.
        limits: The retention limits.
        now: Seconds since 1970.
    """
    finished = (r for r in files.runs if not r.active and r.size and now - r.written > RECENT_S)
    runs = sorted(finished, key=lambda r: r.written)
    evidence = sorted((e for r in files.runs for e in r.evidence), key=lambda e: e.written)
    old_evidence = [e for e in evidence if now - e.written > RECENT_S]
    removed: list[Removal] = [
        *_expired(runs, now - DAY_S * limits.days),
        *_expired(evidence, now - DAY_S * limits.evidence_days),
    ]
    if limits.store_bytes is not None:
        excess = files.size - limits.store_bytes - _freed_bytes(removed)
        removed += _until_freed(excess, [*runs, *old_evidence], removed, RemovalReason.STORE)
    free = files.free + _freed_bytes(removed)
    missing = FREE_SPACE_FACTOR * limits.free_bytes - free if free < limits.free_bytes else 0.0
    removed += _until_freed(missing, [*old_evidence, *runs], removed, RemovalReason.DISK)
    return tuple(removed)


Stored = StoredRun | StoredEvidence


def _expired(items: list[StoredRun] | list[StoredEvidence], before: float) -> Iterator[Removal]:
    yield from (Removal(item, RemovalReason.AGE) for item in items if item.written < before)


def _until_freed(
    needed: float, items: list[Stored], removed: list[Removal], reason: RemovalReason
) -> Iterator[Removal]:
    """The first items that together free enough."""
    removed_ids = {id(removal.what) for removal in removed}
    for item in items:
        if needed <= 0:
            return
        if id(item) not in removed_ids:
            needed -= item.size
            yield Removal(item, reason)


def _freed_bytes(removed: list[Removal]) -> int:
    return sum(removal.size for removal in removed)

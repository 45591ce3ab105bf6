"""What to delete from a store, by age, by the size limit of the store, and by the free space of the disk.

Three rules, in this order: what is too old is deleted; if the store is too large the oldest runs are deleted,
then the evidence of alerts; if the disk is full evidence goes first, because a camera resumes from its
journal. The journal of an active run is never deleted.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum

from visup.serving.room.stored import StoredEvidence, StoredFiles, StoredRun
from visup.serving.site.records import RetentionLimits

DAY_S = 86400.0
FRESH_S = 120.0
"""Runs written within this time are kept: they may have just begun or be closing. So is evidence, except by
age: someone may still be looking at a recent alert."""

SLACK = 1.1
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
        why: The rule.
    """

    what: StoredRun | StoredEvidence
    why: RemovalReason

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
    finished = (r for r in files.runs if not r.goes_on and r.size and now - r.written > FRESH_S)
    runs = sorted(finished, key=lambda r: r.written)
    evidence = sorted((e for r in files.runs for e in r.evidence), key=lambda e: e.written)
    settled = [e for e in evidence if now - e.written > FRESH_S]
    gone: list[Removal] = [
        *_old(runs, now - DAY_S * limits.days),
        *_old(evidence, now - DAY_S * limits.evidence_days),
    ]
    if limits.store_bytes is not None:
        excess = files.size - limits.store_bytes - _freed(gone)
        gone += _freeing(excess, [*runs, *settled], gone, RemovalReason.STORE)
    free = files.free + _freed(gone)
    short = SLACK * limits.free_bytes - free if free < limits.free_bytes else 0.0
    gone += _freeing(short, [*settled, *runs], gone, RemovalReason.DISK)
    return tuple(gone)


Stored = StoredRun | StoredEvidence


def _old(items: list[StoredRun] | list[StoredEvidence], before: float) -> Iterator[Removal]:
    yield from (Removal(item, RemovalReason.AGE) for item in items if item.written < before)


def _freeing(
    needed: float, items: list[Stored], gone: list[Removal], why: RemovalReason
) -> Iterator[Removal]:
    """The first items that together free enough."""
    already = {id(one.what) for one in gone}
    for item in items:
        if needed <= 0:
            return
        if id(item) not in already:
            needed -= item.size
            yield Removal(item, why)


def _freed(gone: list[Removal]) -> int:
    return sum(one.size for one in gone)

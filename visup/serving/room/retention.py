"""What goes from a store, by age, by the room that it may take, and by the room that is left on the disk.

Three rules, in this order: what is too old goes; where the store is too large the oldest runs go, and the
evidence of alerts after them; where the disk is full evidence goes first, since a journal is what a camera
goes on from. A run that is under way keeps its journal.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum

from visup.serving.room.stored import StoredEvidence, StoredFiles, StoredRun
from visup.serving.site.records import RetentionLimits

DAY_S = 86400.0
FRESH_S = 120.0
"""A run that was written to so lately may have just begun, or its books are being closed; whoever was told of
an alert so lately may still look at its evidence."""

SLACK = 1.1
"""So much more than is wanted is freed on a full disk, that not every look finds it full again."""


class RemovalReason(StrEnum):
    """RemovalReason something goes."""

    AGE = "age"
    STORE = "store"
    DISK = "disk"


@dataclass(frozen=True, slots=True)
class Removal:
    """Something that goes.

    Attributes:
        what: A run, all but its evidence; or the evidence of an alert.
        why: By which rule.
    """

    what: StoredRun | StoredEvidence
    why: RemovalReason

    @property
    def size(self) -> int:
        """Bytes that it frees."""
        return self.what.size


def removals(files: StoredFiles, limits: RetentionLimits, now: float) -> tuple[Removal, ...]:
    """What is to go, in this order.

    Args:
        files: What there is.
        limits: What is kept.
        now: Seconds since 1970.
    """
    over = (r for r in files.runs if not r.goes_on and r.size and now - r.written > FRESH_S)
    runs = sorted(over, key=lambda r: r.written)
    evidence = sorted((e for r in files.runs for e in r.evidence), key=lambda e: e.written)
    settled = [e for e in evidence if now - e.written > FRESH_S]
    gone: list[Removal] = [
        *_old(runs, now - DAY_S * limits.days),
        *_old(evidence, now - DAY_S * limits.evidence_days),
    ]
    if limits.store_bytes is not None:
        excess = files.size - limits.store_bytes - _freed(gone)
        gone += _until(excess, [*runs, *settled], gone, RemovalReason.STORE)
    free = files.free + _freed(gone)
    short = SLACK * limits.free_bytes - free if free < limits.free_bytes else 0.0
    gone += _until(short, [*settled, *runs], gone, RemovalReason.DISK)
    return tuple(gone)


Kept = StoredRun | StoredEvidence


def _old(items: list[StoredRun] | list[StoredEvidence], before: float) -> Iterator[Removal]:
    yield from (Removal(item, RemovalReason.AGE) for item in items if item.written < before)


def _until(
    needed: float, items: list[Kept], gone: list[Removal], why: RemovalReason
) -> Iterator[Removal]:
    """So many of them, the first first, that enough is freed."""
    already = {id(one.what) for one in gone}
    for item in items:
        if needed <= 0:
            return
        if id(item) not in already:
            needed -= item.size
            yield Removal(item, why)


def _freed(gone: list[Removal]) -> int:
    return sum(one.size for one in gone)

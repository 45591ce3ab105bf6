"""Actors that rest against each other as one body: who meets one of them meets both.

Which of the two outlines is met first, and whether the other one is met in the image at all, hangs on the
view. In place of the two contacts there is one event: the contact with the one that moves less, if all runs
have it; else either is evidence.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from visup.tasks.learning.relevance import CourseEvent
from visup.tasks.learning.traces import Happening, RunTrace, Symbol

Row = Sequence[CourseEvent]
PASSING_S = 1.0
"""Contacts that are so short, and end so soon after the two have met, were in passing, seconds."""


def as_one_body(rows: Sequence[Row], runs: Sequence[RunTrace]) -> list[list[CourseEvent]]:
    """The events of each run, with contacts with either of two that rest against each other as one event.

    Args:
        rows: The relevant events of each run, in order.
        runs: The runs, in the same order.
    """
    found = [list(row) for row in rows]
    for base, one, other in _alternatives(rows, runs):
        if all(any(e.symbol == one for e in _meant(row, base, (one, other))) for row in rows):
            found = [[e for e in row if not _of_pair(e, other, "converging")] for row in found]
        else:
            found = [_merged(row, base, one, other) for row in found]
    return found


def moved_s(runs: Sequence[RunTrace], actor: str) -> float:
    """How long an actor moved in all runs together, seconds."""
    return sum(run.moved_s.get(actor, 0.0) for run in runs)


def _alternatives(
    rows: Sequence[Row], runs: Sequence[RunTrace]
) -> Iterator[tuple[Symbol, Symbol, Symbol]]:
    """A contact that lasts in all runs, and two that follow it: of a third actor with each of the two.

    First that with the one of the two that moves less.
    """
    contacts = sorted({e.symbol for row in rows for e in row if e.symbol[0] == "touching"})
    for base in (s for s in contacts if all(_lasting(row, s) for row in rows)):
        first, second = sorted(base[1], key=lambda a: moved_s(runs, a))
        for third in sorted({a for _, pair in contacts for a in pair} - set(base[1])):
            one, other = (("touching", tuple(sorted((third, a)))) for a in (first, second))
            both = one in contacts and other in contacts
            if both and all(_follows(row, base, (one, other)) for row in rows):
                yield base, one, other


def _lasting(row: Row, symbol: Symbol) -> bool:
    return any(e.symbol == symbol and e.lasts for e in row)


def _follows(row: Row, base: Symbol, contacts: tuple[Symbol, Symbol]) -> bool:
    """Whether a run has one of the contacts at least, and none before the base but in passing."""
    meant = _meant(row, base, contacts)
    return bool(meant) and meant[0].at > _begin(row, base)


def _meant(row: Row, base: Symbol, contacts: tuple[Symbol, Symbol]) -> list[CourseEvent]:
    """The contacts of a run, without those in passing."""
    begin = _begin(row, base)

    def in_passing(contact: Happening) -> bool:
        return max(contact.end - contact.begin, contact.end - begin) <= PASSING_S

    return [e for e in row if e.symbol in contacts and not in_passing(e.happening)]


def _begin(row: Row, base: Symbol) -> float:
    return min(e.at for e in row if e.symbol == base)


def _merged(row: Row, base: Symbol, one: Symbol, other: Symbol) -> list[CourseEvent]:
    """A row in which the first of two contacts stands for both, to the end of the later one."""
    meant = _meant(row, base, (one, other))
    first, end = meant[0], max(e.happening.end for e in meant)
    happening = Happening(one, first.happening.begin, end, first.happening.begun)
    lasts = any(e.lasts for e in meant)
    event = replace(first, happening=happening, lasts=lasts, instead=(other,))
    kept = (e for e in row if e is first or not (_of_pair(e, one) or _of_pair(e, other)))
    return [event if e is first else e for e in kept]


def _of_pair(event: CourseEvent, contact: Symbol, *more: str) -> bool:
    """Whether an event is a contact of a pair, or its end, or more of that pair."""
    return event.symbol[1] == contact[1] and event.symbol[0] in ("touching", "apart", *more)

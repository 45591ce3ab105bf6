"""Merges the contacts of a third actor with two that rest against each other.

Which of the two outlines is touched first, and whether the other one is touched in the image at all,
depends on the view. The two contacts become one event: the contact with the actor that moves less, if all
runs have it; else either contact is evidence.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from visup.tasks.learning.relevance import CourseEvent, EventSequence
from visup.tasks.learning.traces import ActionInterval, RunTrace, Symbol

PASSING_S = 1.0
"""Contacts that last no longer than this, and end no later than this after the first contact of the two, are
incidental, seconds."""


def with_resting_bodies_merged(
    rows: Sequence[EventSequence], runs: Sequence[RunTrace]
) -> list[list[CourseEvent]]:
    """The events of each run; contacts with two actors that rest against each other become one event.

    Args:
        rows: The relevant events of each run, in order.
        runs: The runs, in the same order.
    """
    found = [list(row) for row in rows]
    for base, one, other in _alternatives(rows, runs):
        if all(
            any(e.symbol == one for e in _contacts_not_in_passing(row, base, (one, other)))
            for row in rows
        ):
            found = [[e for e in row if not _of_pair(e, other, "converging")] for row in found]
        else:
            found = [_merged(row, base, one, other) for row in found]
    return found


def moved_s(runs: Sequence[RunTrace], actor: str) -> float:
    """How long an actor moved in all runs together, seconds."""
    return sum(run.moved_s.get(actor, 0.0) for run in runs)


def _alternatives(
    rows: Sequence[EventSequence], runs: Sequence[RunTrace]
) -> Iterator[tuple[Symbol, Symbol, Symbol]]:
    """A contact that lasts in all runs, and the contacts of a third actor with each of its two actors.

    The contact with the actor that moves less comes first.
    """
    contacts = sorted({e.symbol for row in rows for e in row if e.symbol[0] == "touching"})
    for base in (s for s in contacts if all(_lasts_in(row, s) for row in rows)):
        first, second = sorted(base[1], key=lambda a: moved_s(runs, a))
        for third in sorted({a for _, pair in contacts for a in pair} - set(base[1])):
            one, other = (("touching", tuple(sorted((third, a)))) for a in (first, second))
            both = one in contacts and other in contacts
            if both and all(_follows(row, base, (one, other)) for row in rows):
                yield base, one, other


def _lasts_in(row: EventSequence, symbol: Symbol) -> bool:
    return any(e.symbol == symbol and e.lasts_to_end for e in row)


def _follows(row: EventSequence, base: Symbol, contacts: tuple[Symbol, Symbol]) -> bool:
    """Whether a run has at least one of the contacts, and all but incidental ones after the base."""
    relevant = _contacts_not_in_passing(row, base, contacts)
    return bool(relevant) and relevant[0].at > _begin(row, base)


def _contacts_not_in_passing(
    row: EventSequence, base: Symbol, contacts: tuple[Symbol, Symbol]
) -> list[CourseEvent]:
    """The contacts of a run, without incidental ones."""
    begin = _begin(row, base)

    def in_passing(contact: ActionInterval) -> bool:
        return max(contact.end - contact.begin, contact.end - begin) <= PASSING_S

    return [e for e in row if e.symbol in contacts and not in_passing(e.interval)]


def _begin(row: EventSequence, base: Symbol) -> float:
    return min(e.at for e in row if e.symbol == base)


def _merged(row: EventSequence, base: Symbol, one: Symbol, other: Symbol) -> list[CourseEvent]:
    """A row with the two contacts merged: the first begins, the later one ends."""
    relevant = _contacts_not_in_passing(row, base, (one, other))
    first, end = relevant[0], max(e.interval.end for e in relevant)
    interval = ActionInterval(one, first.interval.begin, end, first.interval.begin_observed)
    lasts_to_end = any(e.lasts_to_end for e in relevant)
    event = replace(first, interval=interval, lasts_to_end=lasts_to_end, alternatives=(other,))
    kept = (e for e in row if e is first or not (_of_pair(e, one) or _of_pair(e, other)))
    return [event if e is first else e for e in kept]


def _of_pair(event: CourseEvent, contact: Symbol, *more: str) -> bool:
    """Whether an event is a contact of a pair or its end, or one of `more` actions of that pair."""
    return event.symbol[1] == contact[1] and event.symbol[0] in ("touching", "apart", *more)

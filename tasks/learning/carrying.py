"""Adds a stage of carrying after a coupling, and a retreat after a release.

An actor that is coupled to another and moves with it is carried. The stage names the destination: the actor
that the carried one meets next, or, if there is none, only its motion. It fails when the two separate. It
is not added where the other actor comes by itself, or still holds the carried one, or where some run does
not show it.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace

from visup.tasks.learning.meetings import CARRIED_S, MEETINGS, Pair
from visup.tasks.learning.relevance import SIMULTANEOUS_S, CourseEvent, EventSequence
from visup.tasks.learning.rests import at_rest
from visup.tasks.learning.traces import ActionInterval, RunTrace, Span, Symbol

NEXT_S = 1e-3
"""Offset that orders an event directly after another one, seconds."""


@dataclass(frozen=True, slots=True)
class _Carriage:
    """A coupling of a run, and the next contact of its actors.

    Attributes:
        coupling: Its event.
        until: When the next event of one of the two begins, or the coupling ends, seconds.
        to: The pair that meets next while they are coupled: one of the two, and a third.
    """

    coupling: CourseEvent
    until: float
    to: Pair | None


def with_carrying(
    rows: Sequence[EventSequence], runs: Sequence[RunTrace]
) -> list[list[CourseEvent]]:
    """The rows with carrying added after couplings, and a retreat after releases.

    Args:
        rows: The relevant events of each run, in order.
        runs: The runs, in the same order.
    """
    found = _without_passing(rows)
    for pair in _pairs(rows, "coupled"):
        found = _with_carrying_of(found, runs, pair)
    for pair in _pairs(rows, "decoupled"):
        found = _with_retreats(found, runs, pair)
    return found


def _without_passing(rows: Sequence[EventSequence]) -> list[list[CourseEvent]]:
    """Rows without incidental contacts: an object carried past its destination touches it again later.

    Contacts that occur equally often in all runs are retained.
    """
    counts = [Counter(e.symbol for e in row if e.symbol[0] == "touching") for row in rows]
    varied = {s for c in counts for s in c if len({d[s] for d in counts}) > 1}
    return [[e for e in row if not _in_passing(e, row, varied)] for row in rows]


def _in_passing(event: CourseEvent, row: EventSequence, varied: Collection[Symbol]) -> bool:
    """Whether an event is a contact, or its end, that a carried actor repeats later."""
    contact = ("touching", event.symbol[1])
    if event.symbol[0] not in ("touching", "apart") or contact not in varied:
        return False
    later = [e.at for e in row if e.symbol == contact and e.at > event.at]
    return any(
        e.symbol[0] == "coupled"
        and len(set(e.symbol[1]) & set(contact[1])) == 1
        and e.at < event.at
        and any(at < e.interval.end for at in later)
        for e in row
    )


def _pairs(rows: Sequence[EventSequence], action: str) -> list[Pair]:
    return sorted({e.symbol[1] for row in rows for e in row if e.symbol[0] == action})


def _with_carrying_of(
    rows: Sequence[EventSequence], runs: Sequence[RunTrace], pair: Pair
) -> list[list[CourseEvent]]:
    """Rows with the carrying of a pair, if each of its couplings shows it in all runs."""
    carriages = [list(_carriages(row, pair)) for row in rows]
    spans = [
        [_joint_motion(run, pair, (c.coupling.at, c.until)) for c in of_run]
        for run, of_run in zip(runs, carriages, strict=True)
    ]
    if not all(span for row in spans for span in row) or any(
        _comes_by_itself(run, c) or _coupled_to_third(row, c)
        for run, row, of_run in zip(runs, rows, carriages, strict=True)
        for c in of_run
    ):
        return [list(row) for row in rows]
    towards = all(
        c.to is not None and _comes_closer(run, c.to, (c.coupling.at, c.until))
        for run, of_run in zip(runs, carriages, strict=True)
        for c in of_run
    )
    cargo = _cargo(pair, runs, carriages)
    found = []
    for row, of_run, spans_of_run in zip(rows, carriages, spans, strict=True):
        events = [
            _carrying_event(
                c, span, ("converging", c.to) if towards and c.to else ("moving", (cargo,))
            )
            for c, span in zip(of_run, spans_of_run, strict=True)
            if span
        ]
        found.append(sorted([*row, *events], key=lambda e: e.at))
    return found


def _carriages(row: EventSequence, pair: Pair) -> Iterator[_Carriage]:
    for k, event in enumerate(row):
        if event.symbol != ("coupled", pair):
            continue
        later = [e for e in row[k + 1 :] if set(e.symbol[1]) & set(pair)]
        meetings = (
            e for e in later if e.symbol[0] in MEETINGS and len(set(e.symbol[1]) & set(pair)) == 1
        )
        meeting = next(meetings, None)
        if meeting is not None and meeting.at > event.interval.end:
            meeting = None
        until = meeting.at if meeting is not None else event.interval.end
        yield _Carriage(event, until, meeting.symbol[1] if meeting is not None else None)


def _comes_by_itself(run: RunTrace, carriage: _Carriage) -> bool:
    """Whether the actor met next moves by itself, as one that takes over does."""
    if carriage.to is None:
        return False
    span = carriage.coupling.at, carriage.until
    (cargo,) = set(carriage.to) & set(carriage.coupling.symbol[1])
    (other,) = set(carriage.to) - {cargo}
    if at_rest(run, other):
        return False
    return _moved_s(run, other, span) > 0.5 * _moved_s(run, cargo, span)


def _moved_s(run: RunTrace, name: str, within: Span) -> float:
    """How long an actor moved within an interval, seconds."""
    spans = run.moves.get(name, ())
    return sum(max(0.0, min(b, within[1]) - max(a, within[0])) for a, b in spans)


def _coupled_to_third(row: EventSequence, carriage: _Carriage) -> bool:
    """Whether one of two actors is still coupled to a third when they become coupled."""
    pair, at = set(carriage.coupling.symbol[1]), carriage.coupling.at
    return any(
        e.symbol[0] == "coupled"
        and len(set(e.symbol[1]) & pair) == 1
        and e.interval.begin < at < e.interval.end
        for e in row
    )


def _joint_motion(run: RunTrace, pair: Pair, within: Span) -> Span | None:
    """From when to when both of a pair move, or None if that is too short."""
    one, other = (run.moves.get(name, ()) for name in pair)
    both = [
        (max(a, c, within[0]), min(b, d, within[1]))
        for a, b in one
        for c, d in other
        if min(b, d, within[1]) > max(a, c, within[0])
    ]
    if sum(b - a for a, b in both) < CARRIED_S:
        return None
    return min(a for a, _ in both), max(b for _, b in both)


def _comes_closer(run: RunTrace, pair: Pair, within: Span) -> bool:
    """Whether two actors converge within an interval."""
    approaches = (interval for interval in run.intervals if interval.symbol == ("converging", pair))
    return any(
        min(interval.end, within[1]) - max(interval.begin, within[0]) > SIMULTANEOUS_S
        for interval in approaches
    )


def _cargo(pair: Pair, runs: Sequence[RunTrace], carriages: Sequence[Sequence[_Carriage]]) -> str:
    """Which of two is carried: the one that moves less before they are coupled."""

    def before(name: str) -> float:
        return sum(
            max(0.0, min(b, of_run[0].coupling.at) - a)
            for run, of_run in zip(runs, carriages, strict=True)
            if of_run
            for a, b in run.moves.get(name, ())
        )

    return min(pair, key=before)


def _carrying_event(carriage: _Carriage, span: Span, goal: Symbol) -> CourseEvent:
    symbol = ("moving_together", carriage.coupling.symbol[1])
    at = max(span[0], carriage.coupling.at + NEXT_S)
    return CourseEvent(ActionInterval(symbol, at, span[1]), at, carried_symbol=goal)


def _with_retreats(
    rows: Sequence[EventSequence], runs: Sequence[RunTrace], pair: Pair
) -> list[list[CourseEvent]]:
    """Rows with a retreat of the two after each release, if all runs show it."""
    found = []
    for row, run in zip(rows, runs, strict=True):
        releases = [e for e in row if e.symbol == ("decoupled", pair)]
        events = [_retreat(run, e, pair) for e in releases]
        if None in events:
            return [list(r) for r in rows]
        found.append(sorted([*row, *(e for e in events if e)], key=lambda e: e.at))
    return found


def _retreat(run: RunTrace, release: CourseEvent, pair: Pair) -> CourseEvent | None:
    retreats = (interval for interval in run.intervals if interval.symbol == ("diverging", pair))
    last = next(
        (interval for interval in retreats if interval.end > release.at + SIMULTANEOUS_S), None
    )
    if last is None:
        return None
    at = max(last.begin, release.at + NEXT_S)
    return CourseEvent(replace(last, begin=at), at)

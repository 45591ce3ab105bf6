"""Selection of the relevant events of each run: meetings, approaches that lead to them, and partings.

A camera observes incidental contacts as well: carried objects touch those they pass, and outlines touch where
one body overlaps another. The result is one event sequence for each run, comparable between runs.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass

from visup.tasks.learning.meetings import (
    DETECTION_DELAY_S,
    MEETINGS,
    Meeting,
    Pair,
    meetings_of,
    pairs_by_weight,
)
from visup.tasks.learning.order import CarryingStage, Conjunction, Disjunction, Item, Proximity
from visup.tasks.learning.traces import ActionInterval, RunTrace, Symbol

CUT_OFF_S = 0.3
"""A meeting that ends this long before the run has ended by itself, seconds; later ones are cut off."""


@dataclass(frozen=True, slots=True)
class CourseEvent:
    """An event in the sequence of a run.

    Attributes:
        interval: Its symbol and interval.
        at: Time by which it is ordered, seconds: an approach has that of its meeting.
        lasts_to_end: Whether it lasts to the end of the run.
        simultaneous: Symbols of simultaneous events joined with it.
        alternatives: Symbols that are evidence of the same event.
        carried_symbol: For carrying: what the carried actor does.
        proximity: For two that stay near each other: how near, and for how long.
    """

    interval: ActionInterval
    at: float
    lasts_to_end: bool = False
    simultaneous: tuple[Symbol, ...] = ()
    alternatives: tuple[Symbol, ...] = ()
    carried_symbol: Symbol | None = None
    proximity: Proximity | None = None

    @property
    def symbol(self) -> Symbol:
        """The symbol; the first of several."""
        return self.interval.symbol

    @property
    def item(self) -> Item:
        """The symbol, or several: all of them, or any."""
        if self.alternatives:
            return Disjunction((self.symbol, *self.alternatives))
        if self.carried_symbol is not None:
            return CarryingStage((self.symbol, self.carried_symbol))
        if self.proximity is not None:
            return self.proximity
        return Conjunction((self.symbol, *self.simultaneous)) if self.simultaneous else self.symbol


EventSequence = Sequence[CourseEvent]
"""The events of a run, in order."""


def relevant_events(runs: Sequence[RunTrace]) -> list[list[CourseEvent]]:
    """The relevant events of each run, in order.

    A contact that becomes a coupling in all runs is that coupling; otherwise both are contacts. Objects
    coupled to the same one move and meet as it does. An approach counts when it leads to a meeting, a
    parting when it ends one. If nobody ever meets, all events count.
    """
    met = meetings_of(runs, pairs_by_weight(runs))
    if not any(met):
        return [
            [CourseEvent(interval, interval.begin) for interval in run.intervals] for run in runs
        ]
    actions = _action_of_each_pair(met)
    begins = {pair for pair in _pairs_observed_to_begin(met) if actions[pair] == "touching"}
    hidden = {m.pair for rows in met for m in rows} - _shared_pairs(met)
    return [
        sorted(
            [
                *_events(run, rows, actions),
                *_meetings_from_start(run, rows, begins),
                *_hidden_approaches(run, rows, hidden),
            ],
            key=lambda e: (e.at, _ORDER_AT_SAME_TIME[e.symbol[0]], e.symbol),
        )
        for run, rows in zip(runs, met, strict=True)
    ]


def _shared_pairs(met: Sequence[Collection[Meeting]]) -> set[Pair]:
    """Pairs that meet in every run."""
    return set.intersection(*({m.pair for m in rows} for rows in met))


def _pairs_observed_to_begin(met: Sequence[Collection[Meeting]]) -> set[Pair]:
    """Pairs whose meeting is observed to begin in more than half of the runs in which they meet."""
    together = Counter(pair for rows in met for pair in {m.pair for m in rows})
    begun = Counter(pair for rows in met for pair in {m.pair for m in rows if m.begin_observed})
    return {pair for pair, runs in begun.items() if 2 * runs > together[pair]}


def _meetings_from_start(
    run: RunTrace, meetings: Sequence[Meeting], pairs: Collection[Pair]
) -> Iterator[CourseEvent]:
    """Meetings present from the start of this run, by overlap in the image, that begin in most runs.

    They count from the end of the approach.
    """
    for meeting in meetings:
        begin, end = meeting.touching
        if meeting.pair not in pairs or meeting.begin_observed or end <= run.end - CUT_OFF_S:
            continue
        symbol = ("converging", meeting.pair)
        nearing = [
            interval
            for interval in run.intervals
            if interval.symbol == symbol and begin <= interval.begin < end
        ]
        if nearing:
            near = nearing[0].end
            touch = ActionInterval(("touching", meeting.pair), near, end, begin_observed=False)
            yield CourseEvent(nearing[0], near)
            yield CourseEvent(touch, near, lasts_to_end=True)


def _hidden_approaches(
    run: RunTrace, rows: Sequence[Meeting], pairs: Collection[Pair]
) -> Iterator[CourseEvent]:
    """Approaches whose meeting is not observed in this run, as when one enters the other and is hidden.

    A meeting that is observed, but not counted since one of the two was carried along, is none of these.
    """
    met = {m.pair for m in rows} | {
        interval.symbol[1] for interval in run.intervals if interval.symbol[0] in MEETINGS
    }
    for pair in pairs:
        found = [interval for interval in run.intervals if interval.symbol == ("converging", pair)]
        if pair not in met and found:
            yield CourseEvent(found[0], found[0].begin)


_ORDER_AT_SAME_TIME = {"converging": 0, "touching": 1, "coupled": 1, "apart": 2, "decoupled": 2}


def _action_of_each_pair(met: Sequence[Collection[Meeting]]) -> dict[Pair, str]:
    """The action of each pair: coupled if one carries the other in every run in which they meet.

    Whether two bodies at rest against each other are detected as coupled is random.
    """
    pairs = {m.pair for rows in met for m in rows}
    return {
        pair: "coupled"
        if all(
            any(m.carries for m in rows if m.pair == pair)
            for rows in met
            if any(m.pair == pair for m in rows)
        )
        else "touching"
        for pair in pairs
    }


def _events(
    run: RunTrace, meetings: Sequence[Meeting], actions: Mapping[Pair, str]
) -> Iterator[CourseEvent]:
    for meeting in meetings:
        action, pair = actions[meeting.pair], meeting.pair
        span = meeting.span(action)
        if span is None:
            continue
        begin, end = span
        lasts = end > run.end - CUT_OFF_S
        if meeting.begin_observed:  # a stage is completed by a change within it
            approach = _approach(run, pair, meeting.touching[0], begin)
            if approach is not None and not _carried_by_third(meeting, begin, meetings, actions):
                yield CourseEvent(approach, begin)
            yield CourseEvent(ActionInterval((action, pair), begin, end), begin, lasts)
        elif action == "coupled":  # held from the start on
            yield CourseEvent(
                ActionInterval((action, pair), begin, end, begin_observed=False), begin, lasts
            )
        if not lasts and (action == "coupled" or _separates(run, pair, end)):
            parting = "decoupled" if action == "coupled" else "apart"
            yield CourseEvent(ActionInterval((parting, pair), end, run.end), end)


def _separates(run: RunTrace, pair: Pair, end: float) -> bool:
    """Whether two separate when their contact ends: that of bodies at rest merely ceases to be detected."""
    parting = (interval for interval in run.intervals if interval.symbol == ("diverging", pair))
    return any(
        interval.begin <= end + DETECTION_DELAY_S and interval.end >= end - DETECTION_DELAY_S
        for interval in parting
    )


def _carried_by_third(
    meeting: Meeting, at: float, meetings: Sequence[Meeting], actions: Mapping[Pair, str]
) -> bool:
    """Whether a third actor carries one of two when they meet: that is an event of its own."""
    third = (m for m in meetings if set(m.pair) & set(meeting.pair) and m is not meeting)
    others = (m.coupled for m in third if actions[m.pair] == "coupled")
    return any(span is not None and span[0] < at <= span[1] + DETECTION_DELAY_S for span in others)


def _approach(run: RunTrace, pair: Pair, touch: float, begin: float) -> ActionInterval | None:
    """The last approach of a pair before it meets."""
    found = [
        interval
        for interval in run.intervals
        if interval.symbol == ("converging", pair)
        and interval.begin <= begin + SIMULTANEOUS_S
        and interval.end >= touch - DETECTION_DELAY_S
    ]
    return found[-1] if found else None


SIMULTANEOUS_S = 0.3
"""Detection delay, seconds: events closer together than this may be detected in either order."""


def with_simultaneous_joined(rows: Sequence[EventSequence]) -> list[list[CourseEvent]]:
    """Rows with events that begin at once, and overlap in all runs, merged into joint events.

    Which of them is detected first is random, so their order is not required.
    """
    once = [{e.symbol: e for e in row if _occurs_once(e, row)} for row in rows]
    common = sorted(set.intersection(*(set(events) for events in once))) if once else []
    groups: list[list[Symbol]] = []
    for symbol in common:
        if symbol[0] == "converging":
            continue
        group = next((g for g in groups if all(_simultaneous(once, symbol, s) for s in g)), None)
        if group is None:
            groups.append([symbol])
        else:
            group.append(symbol)
    return [_with_conjunctions(row, [g for g in groups if len(g) > 1]) for row in rows]


def _occurs_once(event: CourseEvent, row: EventSequence) -> bool:
    return not event.alternatives and sum(e.symbol == event.symbol for e in row) == 1


def _simultaneous(once: Sequence[Mapping[Symbol, CourseEvent]], a: Symbol, b: Symbol) -> bool:
    """Whether two events begin at once in some run and overlap in all."""
    if a[1] == b[1]:
        return False
    pairs = [(events[a], events[b]) for events in once]
    close = any(abs(x.at - y.at) < SIMULTANEOUS_S for x, y in pairs)
    return close and all(_common_s(x.interval, y.interval) > SIMULTANEOUS_S for x, y in pairs)


def _common_s(a: ActionInterval, b: ActionInterval) -> float:
    return min(a.end, b.end) - max(a.begin, b.begin)


def _with_conjunctions(row: EventSequence, groups: Sequence[Sequence[Symbol]]) -> list[CourseEvent]:
    """A row with each group replaced by a joint event at the position of its last member."""
    found = list(row)
    for group in groups:
        parts = sorted((e for e in found if e.symbol in group), key=lambda e: group.index(e.symbol))
        last = max(parts, key=lambda e: e.at)
        end = min(e.interval.end for e in parts)
        conjunction = CourseEvent(
            ActionInterval(
                parts[0].symbol,
                last.interval.begin,
                end,
                all(e.interval.begin_observed for e in parts),
            ),
            last.at,
            all(e.lasts_to_end or e.symbol[0] in SEPARATIONS for e in parts),
            tuple(e.symbol for e in parts[1:]),
        )
        found = [conjunction if e is last else e for e in found if e is last or e not in parts]
    return found


SEPARATIONS = ("apart", "decoupled")

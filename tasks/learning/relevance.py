"""Selection of the relevant events of each run: meetings, approaches that lead to them, and partings.

A camera observes incidental contacts as well: carried objects touch those they pass, and outlines touch where
one body overlaps another. The result is one event sequence for each run, comparable between runs.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass

from visup.tasks.learning.meetings import (
    CLOSE_S,
    MEETINGS,
    Meeting,
    Pair,
    meetings_of,
    pairs_by_weight,
)
from visup.tasks.learning.order import Carry, Either, Item, Joint, Keep
from visup.tasks.learning.traces import Happening, RunTrace, Symbol

ENDED_S = 0.3
"""A meeting that ends this long before the run has ended by itself, seconds; later ones are cut off."""


@dataclass(frozen=True, slots=True)
class CourseEvent:
    """An event in the sequence of a run.

    Attributes:
        happening: Its symbol and interval.
        at: Time by which it is ordered, seconds: an approach has that of its meeting.
        lasts: Whether it lasts to the end of the run.
        beside: Symbols of simultaneous events joined with it.
        instead: Symbols that are evidence of the same event.
        carries: What the carried one does, of an event in which one carries the other.
        keeps: How near to each other two keep, of an event in which they do.
    """

    happening: Happening
    at: float
    lasts: bool = False
    beside: tuple[Symbol, ...] = ()
    instead: tuple[Symbol, ...] = ()
    carries: Symbol | None = None
    keeps: Keep | None = None

    @property
    def symbol(self) -> Symbol:
        """The symbol; the first of several."""
        return self.happening.symbol

    @property
    def item(self) -> Item:
        """The symbol, or several: all of them, or any."""
        if self.instead:
            return Either((self.symbol, *self.instead))
        if self.carries is not None:
            return Carry((self.symbol, self.carries))
        if self.keeps is not None:
            return self.keeps
        return Joint((self.symbol, *self.beside)) if self.beside else self.symbol


def relevant(runs: Sequence[RunTrace]) -> list[list[CourseEvent]]:
    """The relevant events of each run, in order.

    A contact that becomes a coupling in all runs is that coupling; otherwise both are contacts. Objects
    coupled to the same one move and meet as it does. An approach counts when it leads to a meeting, a
    parting when it ends one. If nobody ever meets, all events count.
    """
    met = meetings_of(runs, pairs_by_weight(runs))
    if not any(met):
        return [[CourseEvent(h, h.begin) for h in run.happenings] for run in runs]
    words = _words(met)
    begins = {pair for pair in _beginning(met) if words[pair] == "touching"}
    hidden = {m.pair for rows in met for m in rows} - _shared_pairs(met)
    return [
        sorted(
            [*_events(run, rows, words), *_late(run, rows, begins), *_towards(run, rows, hidden)],
            key=lambda e: (e.at, _RANK[e.symbol[0]], e.symbol),
        )
        for run, rows in zip(runs, met, strict=True)
    ]


def _shared_pairs(met: Sequence[Collection[Meeting]]) -> set[Pair]:
    """Pairs that meet in every run."""
    return set.intersection(*({m.pair for m in rows} for rows in met))


def _beginning(met: Sequence[Collection[Meeting]]) -> set[Pair]:
    """Pairs whose meeting is observed to begin in more than half of the runs in which they meet."""
    together = Counter(pair for rows in met for pair in {m.pair for m in rows})
    begun = Counter(pair for rows in met for pair in {m.pair for m in rows if m.begun})
    return {pair for pair, runs in begun.items() if 2 * runs > together[pair]}


def _late(
    run: RunTrace, meetings: Sequence[Meeting], pairs: Collection[Pair]
) -> Iterator[CourseEvent]:
    """Meetings present from the start of this run, by overlap in the image, that begin in most runs.

    They count from the end of the approach.
    """
    for meeting in meetings:
        begin, end = meeting.touching
        if meeting.pair not in pairs or meeting.begun or end <= run.end - ENDED_S:
            continue
        symbol = ("converging", meeting.pair)
        nearing = [h for h in run.happenings if h.symbol == symbol and begin <= h.begin < end]
        if nearing:
            near = nearing[0].end
            touch = Happening(("touching", meeting.pair), near, end, begun=False)
            yield CourseEvent(nearing[0], near)
            yield CourseEvent(touch, near, lasts=True)


def _towards(
    run: RunTrace, rows: Sequence[Meeting], pairs: Collection[Pair]
) -> Iterator[CourseEvent]:
    """Approaches whose meeting is not observed in this run, as when one enters the other and is hidden.

    A meeting that is observed, but not counted since one of the two was carried along, is none of these.
    """
    met = {m.pair for m in rows} | {h.symbol[1] for h in run.happenings if h.symbol[0] in MEETINGS}
    for pair in pairs:
        found = [h for h in run.happenings if h.symbol == ("converging", pair)]
        if pair not in met and found:
            yield CourseEvent(found[0], found[0].begin)


_RANK = {"converging": 0, "touching": 1, "coupled": 1, "apart": 2, "decoupled": 2}


def _words(met: Sequence[Collection[Meeting]]) -> dict[Pair, str]:
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
    run: RunTrace, meetings: Sequence[Meeting], words: Mapping[Pair, str]
) -> Iterator[CourseEvent]:
    for meeting in meetings:
        action, pair = words[meeting.pair], meeting.pair
        spell = meeting.spell(action)
        if spell is None:
            continue
        begin, end = spell
        lasts = end > run.end - ENDED_S
        if meeting.begun:  # a stage is completed by a change within it
            approach = _approach(run, pair, meeting.touching[0], begin)
            if approach is not None and not _held_elsewhere(meeting, begin, meetings, words):
                yield CourseEvent(approach, begin)
            yield CourseEvent(Happening((action, pair), begin, end), begin, lasts)
        elif action == "coupled":  # held from the start on
            yield CourseEvent(Happening((action, pair), begin, end, begun=False), begin, lasts)
        if not lasts and (action == "coupled" or _parts(run, pair, end)):
            parting = "decoupled" if action == "coupled" else "apart"
            yield CourseEvent(Happening((parting, pair), end, run.end), end)


def _parts(run: RunTrace, pair: Pair, end: float) -> bool:
    """Whether two separate when their contact ends: that of bodies at rest merely ceases to be detected."""
    parting = (h for h in run.happenings if h.symbol == ("diverging", pair))
    return any(h.begin <= end + CLOSE_S and h.end >= end - CLOSE_S for h in parting)


def _held_elsewhere(
    meeting: Meeting, at: float, meetings: Sequence[Meeting], words: Mapping[Pair, str]
) -> bool:
    """Whether a third actor carries one of two when they meet: carrying it there is told as such."""
    third = (m for m in meetings if set(m.pair) & set(meeting.pair) and m is not meeting)
    others = (m.coupled for m in third if words[m.pair] == "coupled")
    return any(spell is not None and spell[0] < at <= spell[1] + CLOSE_S for spell in others)


def _approach(run: RunTrace, pair: Pair, touch: float, begin: float) -> Happening | None:
    """The last approach of a pair before it meets."""
    found = [
        h
        for h in run.happenings
        if h.symbol == ("converging", pair)
        and h.begin <= begin + AT_ONCE_S
        and h.end >= touch - CLOSE_S
    ]
    return found[-1] if found else None


AT_ONCE_S = 0.3
"""Detection delay, seconds: events closer together than this may be detected in either order."""

Row = Sequence[CourseEvent]


def joined(rows: Sequence[Row]) -> list[list[CourseEvent]]:
    """Rows with events that begin at once, and overlap in all runs, merged into joint events.

    Which of them is detected first is random, so their order is not required.
    """
    once = [{e.symbol: e for e in row if _single(e, row)} for row in rows]
    shared = sorted(set.intersection(*(set(events) for events in once))) if once else []
    groups: list[list[Symbol]] = []
    for symbol in shared:
        if symbol[0] == "converging":
            continue
        group = next((g for g in groups if all(_together(once, symbol, s) for s in g)), None)
        if group is None:
            groups.append([symbol])
        else:
            group.append(symbol)
    return [_with_joints(row, [g for g in groups if len(g) > 1]) for row in rows]


def _single(event: CourseEvent, row: Row) -> bool:
    return not event.instead and sum(e.symbol == event.symbol for e in row) == 1


def _together(once: Sequence[Mapping[Symbol, CourseEvent]], a: Symbol, b: Symbol) -> bool:
    """Whether two events begin at once in some run and overlap in all."""
    if a[1] == b[1]:
        return False
    pairs = [(events[a], events[b]) for events in once]
    close = any(abs(x.at - y.at) < AT_ONCE_S for x, y in pairs)
    return close and all(_overlap(x.happening, y.happening) > AT_ONCE_S for x, y in pairs)


def _overlap(a: Happening, b: Happening) -> float:
    return min(a.end, b.end) - max(a.begin, b.begin)


def _with_joints(row: Row, groups: Sequence[Sequence[Symbol]]) -> list[CourseEvent]:
    """A row with each group replaced by a joint event at the position of its last member."""
    found = list(row)
    for group in groups:
        parts = sorted((e for e in found if e.symbol in group), key=lambda e: group.index(e.symbol))
        last = max(parts, key=lambda e: e.at)
        end = min(e.happening.end for e in parts)
        joint = CourseEvent(
            Happening(
                parts[0].symbol, last.happening.begin, end, all(e.happening.begun for e in parts)
            ),
            last.at,
            all(e.lasts or e.symbol[0] in PARTINGS for e in parts),
            tuple(e.symbol for e in parts[1:]),
        )
        found = [joint if e is last else e for e in found if e is last or e not in parts]
    return found


PARTINGS = ("apart", "decoupled")

"""What a run is made of: meetings, what leads to them, and partings; not what only comes along.

A camera sees more than was meant: what is carried meets what it is carried past, outlines touch where one
body stands before another. What is left is one row of happenings for each run, alike in all.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass

from visup.tasks.learning.meetings import CLOSE_S, Meeting, Pair, meetings_of, pairs_by_weight
from visup.tasks.learning.order import Item, Joint
from visup.tasks.learning.traces import Happening, RunTrace, Symbol

ENDED_S = 0.3
"""A meeting that ends so long before the run does has ended, and is not cut off."""


@dataclass(frozen=True, slots=True)
class CourseEvent:
    """A happening in the row of a run.

    Attributes:
        happening: What, from when to when.
        at: Seconds by which it is ordered: an approach comes with its meeting.
        lasts: Whether it goes on to the end of the run.
        beside: What happens with it.
    """

    happening: Happening
    at: float
    lasts: bool = False
    beside: tuple[Symbol, ...] = ()

    @property
    def symbol(self) -> Symbol:
        """What happens; the first of several."""
        return self.happening.symbol

    @property
    def item(self) -> Item:
        """What happens."""
        return Joint((self.symbol, *self.beside)) if self.beside else self.symbol


def relevant(runs: Sequence[RunTrace]) -> list[list[CourseEvent]]:
    """What each run is made of, in order.

    A touch that becomes a coupling is that coupling, where it does so in all runs; else both are touches.
    What is coupled to the same thing moves and meets as that does. An approach counts when it leads to a
    meeting, a parting when it ends one. Where nobody ever meets all counts.
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
    """Pairs that are seen to meet in most of the runs in which they are together."""
    together = Counter(pair for rows in met for pair in {m.pair for m in rows})
    begun = Counter(pair for rows in met for pair in {m.pair for m in rows if m.begun})
    return {pair for pair, runs in begun.items() if 2 * runs > together[pair]}


def _late(
    run: RunTrace, meetings: Sequence[Meeting], pairs: Collection[Pair]
) -> Iterator[CourseEvent]:
    """Meetings that are so from the start of this run, where one body covers the other, and begin in most.

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
    """Approaches whose meeting is not seen in this run, as when one goes into the other and is hidden."""
    met = {m.pair for m in rows}
    for pair in pairs:
        found = [h for h in run.happenings if h.symbol == ("converging", pair)]
        if pair not in met and found:
            yield CourseEvent(found[0], found[0].begin)


_RANK = {"converging": 0, "touching": 1, "coupled": 1, "apart": 2, "decoupled": 2}


def _words(met: Sequence[Collection[Meeting]]) -> dict[Pair, str]:
    """How each pair meets: coupled where one carries the other in every run in which they meet.

    Of two that rest against each other it is chance whether they are taken to be coupled.
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
        if meeting.begun:  # a stage is done by what comes about in it
            approach = _approach(run, pair, meeting.touching[0], begin)
            if approach is not None and not _held_elsewhere(meeting, begin, meetings):
                yield CourseEvent(approach, begin)
            yield CourseEvent(Happening((action, pair), begin, end), begin, lasts)
        if not lasts and (action == "coupled" or _parts(run, pair, end)):
            parting = "decoupled" if action == "coupled" else "apart"
            yield CourseEvent(Happening((parting, pair), end, run.end), end)


def _parts(run: RunTrace, pair: Pair, end: float) -> bool:
    """Whether two go apart when their contact ends: that of two at rest only ceases to be seen."""
    parting = (h for h in run.happenings if h.symbol == ("diverging", pair))
    return any(h.begin <= end + CLOSE_S and h.end >= end - CLOSE_S for h in parting)


def _held_elsewhere(meeting: Meeting, at: float, meetings: Sequence[Meeting]) -> bool:
    """Whether a third holds one of two when they meet: how it is carried there is no stage."""
    others = (m.coupled for m in meetings if set(m.pair) & set(meeting.pair) and m is not meeting)
    return any(spell is not None and spell[0] < at <= spell[1] + CLOSE_S for spell in others)


def _approach(run: RunTrace, pair: Pair, touch: float, begin: float) -> Happening | None:
    """The last time that they draw nearer before they meet."""
    found = [
        h
        for h in run.happenings
        if h.symbol == ("converging", pair) and h.begin <= begin and h.end >= touch - CLOSE_S
    ]
    return found[-1] if found else None


AT_ONCE_S = 0.3
"""Relations are judged with delays: what comes closer together than so may be seen in either order."""

Row = Sequence[CourseEvent]


def joined(rows: Sequence[Row]) -> list[list[CourseEvent]]:
    """Rows in which what comes about at once, and goes on together in all runs, is one event.

    Which of the two is seen first is chance, so that no order of theirs is asked for.
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
    return sum(e.symbol == event.symbol for e in row) == 1


def _together(once: Sequence[Mapping[Symbol, CourseEvent]], a: Symbol, b: Symbol) -> bool:
    """Whether two come at once in some run, and go on together for a while in all."""
    if a[1] == b[1]:
        return False
    pairs = [(events[a], events[b]) for events in once]
    close = any(abs(x.at - y.at) < AT_ONCE_S for x, y in pairs)
    return close and all(_overlap(x.happening, y.happening) > AT_ONCE_S for x, y in pairs)


def _overlap(a: Happening, b: Happening) -> float:
    return min(a.end, b.end) - max(a.begin, b.begin)


def _with_joints(row: Row, groups: Sequence[Sequence[Symbol]]) -> list[CourseEvent]:
    """A row with each group in the place of its last one."""
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

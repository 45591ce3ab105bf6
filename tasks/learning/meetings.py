"""Meetings (contacts and couplings) between actors of a run, without those of merely carried objects."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cmp_to_key

from visup.tasks.learning.traces import BREAK_S, Happening, RunTrace, Span

Pair = tuple[str, ...]
MEETINGS = ("touching", "coupled")
LET_GO_S = 1.0
"""A meeting of a carried object ends at most this long after its carrier drew back, seconds."""
MOSTLY = 0.5
"""A pair counts as carried along when its meetings do in more than this share of the runs."""
CLOSE_S = 2.0
"""Tolerance for detection delays of relations, seconds: changes closer than this may belong together."""
MUCH_LESS = 0.9
"""Pairs whose durations have a ratio above this are ranked by who rests."""
CARRIED_S = 0.5
"""Least time that coupled actors must move together for one to carry the other, seconds."""


@dataclass(frozen=True, slots=True)
class Meeting:
    """An interval in which two actors are in contact.

    Attributes:
        pair: The actors.
        touching: First to last contact.
        coupled: First to last coupling, or None when they only touch.
        begun: Whether its beginning was observed, not there from the start.
        carries: Whether they move together while coupled.
    """

    pair: Pair
    touching: Span
    coupled: Span | None
    begun: bool = True
    carries: bool = False

    def spell(self, action: str) -> Span | None:
        """The interval of the coupling or of the contact."""
        return self.coupled if action == "coupled" else self.touching


def pairs_by_weight(runs: Sequence[RunTrace]) -> list[Pair]:
    """Pairs in contact, ascending by number of runs, then by duration; near ties: most motion first.

    An object placed on a resting one meets that one, not another placed there before.
    """
    seconds: dict[Pair, list[float]] = {}
    for run in runs:
        mine: dict[Pair, float] = {}
        for h in run.happenings:
            if h.symbol[0] in MEETINGS:
                mine[h.symbol[1]] = mine.get(h.symbol[1], 0.0) + h.end - h.begin
        for pair, long in mine.items():
            seconds.setdefault(pair, []).append(long)

    def moved(pair: Pair) -> float:
        return sum(run.moved_s.get(name, 0.0) for run in runs for name in pair)

    def compared(p: Pair, q: Pair) -> int:
        runs_more, long, other = len(seconds[p]) - len(seconds[q]), sum(seconds[p]), sum(seconds[q])
        if runs_more or min(long, other) < MUCH_LESS * max(long, other):
            return runs_more or (1 if long > other else -1)
        return 1 if (moved(q), p) > (moved(p), q) else -1

    return sorted(seconds, key=cmp_to_key(compared))


def meetings_of(runs: Sequence[RunTrace], pairs: Sequence[Pair]) -> list[list[Meeting]]:
    """The meetings of each run, without those of objects that are merely carried along.

    A pair is carried along in all runs or in none, since the order in which meetings end at a release is
    random.

    Args:
        runs: The runs.
        pairs: All pairs; of several that meet through each other the first is dropped.
    """
    real = [_meetings(run) for run in runs]
    for pair in pairs:
        meet = sum(any(m.pair == pair for m in row) for row in real)
        along = sum(any(m.pair == pair and _carried(m, row, 1) for m in row) for row in real)
        if along > MOSTLY * meet:
            # In the other runs a looser tolerance is then enough.
            real = [[m for m in r if m.pair != pair or not _carried(m, r, 2)] for r in real]
    return real


def _meetings(run: RunTrace) -> list[Meeting]:
    """Contacts of the same pair, separated by short breaks only, merged into one meeting."""
    found: list[list[Happening]] = []
    for h in run.happenings:
        if h.symbol[0] not in MEETINGS:
            continue
        of_pair = [g for g in found if g[0].symbol[1] == h.symbol[1]]
        if of_pair and h.begin <= max(g.end for g in of_pair[-1]) + BREAK_S:
            of_pair[-1].append(h)
        else:
            found.append([h])
    return [_meeting(group, run) for group in found]


def _meeting(spells: Sequence[Happening], run: RunTrace) -> Meeting:
    coupled = [h for h in spells if h.symbol[0] == "coupled"]
    pair = spells[0].symbol[1]
    spell = (coupled[0].begin, max(h.end for h in coupled)) if coupled else None
    return Meeting(
        pair,
        (spells[0].begin, max(h.end for h in spells)),
        spell,
        spells[0].begun,
        spell is not None and _together_s(run, pair, spell) >= CARRIED_S,
    )


def _together_s(run: RunTrace, pair: Pair, spell: Span) -> float:
    """How long both of a pair moved within an interval, seconds."""
    one, other = (run.moves.get(name, ()) for name in pair)
    return sum(
        max(0.0, min(b, d, spell[1]) - max(a, c, spell[0])) for a, b in one for c, d in other
    )


def _carried(meeting: Meeting, meetings: Sequence[Meeting], slack: int) -> bool:
    """Whether two meet only through a third object, which one carries and which meets the other.

    The meeting ends when the carrier has drawn back from what it carried, so that the two no longer touch, or
    up to `slack` times `LET_GO_S` later. In the image it may begin long before, where one overlaps the other.
    """
    begin, end = meeting.touching
    overlap = [m for m in meetings if m.touching[0] <= end and m.touching[1] >= begin]
    for held in overlap:
        if not held.carries or end > held.touching[1] + slack * LET_GO_S:
            continue
        for a, b in (meeting.pair, meeting.pair[::-1]):
            if a not in held.pair or b in held.pair:
                continue
            (x,) = set(held.pair) - {a}
            if any({x, b} == set(m.pair) and m.touching[1] > end - CLOSE_S for m in overlap):
                return True
    return False

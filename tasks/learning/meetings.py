"""Who meets whom in a run, and who only comes along with what another carries."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cmp_to_key

from visup.tasks.learning.traces import BREAK_S, Happening, RunTrace, Span

Pair = tuple[str, ...]
MEETINGS = ("touching", "coupled")
LET_GO_S = 1.0
"""What is carried meets others no longer than so long after it was let go."""
MOSTLY = 0.5
"""A pair only comes along where its meetings do in more than that share of the runs."""
CLOSE_S = 2.0
"""Relations are judged with delays: what ends or begins so much earlier may be the same matter."""
MUCH_LESS = 0.9
"""Pairs whose meetings differ by less are told apart by who rests."""
CARRIED_S = 0.5
"""So long two that are coupled must be on the move together for one to carry the other."""


@dataclass(frozen=True, slots=True)
class Meeting:
    """Two that are together for a while.

    Attributes:
        pair: Who.
        touching: Their first to last touch.
        coupled: First to last coupling, or None when they only touch.
        begun: Whether it was seen to begin, and was not so from the start.
        carries: Whether they are on the move together while they are coupled.
    """

    pair: Pair
    touching: Span
    coupled: Span | None
    begun: bool = True
    carries: bool = False

    def spell(self, action: str) -> Span | None:
        """From when to when, as one of the two."""
        return self.coupled if action == "coupled" else self.touching


def pairs_by_weight(runs: Sequence[RunTrace]) -> list[Pair]:
    """Pairs that touch: in the fewest runs, or for much less long, first; then those that move most.

    What is put on a thing that rests meets that thing, and not what was put on it before.
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
    """All meetings of each run but those of what is only carried along.

    A pair is carried along in all runs or in none: which of two ends first when one lets go is chance.

    Args:
        runs: The runs.
        pairs: All pairs; of several that meet through each other the first one is let be.
    """
    real = [_meetings(run) for run in runs]
    for pair in pairs:
        meet = sum(any(m.pair == pair for m in row) for row in real)
        along = sum(any(m.pair == pair and _carried(m, row, 1) for m in row) for row in real)
        if along > MOSTLY * meet:
            # Nearly so in the others, then, is so in them too.
            real = [[m for m in r if m.pair != pair or not _carried(m, r, 2)] for r in real]
    return real


def _meetings(run: RunTrace) -> list[Meeting]:
    """What happens between the same two with short breaks is one meeting."""
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
    """For how long in a while both of a pair were on the move, seconds."""
    one, other = (run.moves.get(name, ()) for name in pair)
    return sum(
        max(0.0, min(b, d, spell[1]) - max(a, c, spell[0])) for a, b in one for c, d in other
    )


def _carried(meeting: Meeting, meetings: Sequence[Meeting], slack: int) -> bool:
    """Whether two meet only through a third thing, which one carries and which meets the other.

    The meeting ends as soon as what is carried is let go, or so many times `LET_GO_S` later. In the image
    it may begin long before, where one stands before the other.
    """
    begin, end = meeting.touching
    overlap = [m for m in meetings if m.touching[0] <= end and m.touching[1] >= begin]
    for held in overlap:
        if not held.carries or held.coupled is None or end > held.coupled[1] + slack * LET_GO_S:
            continue
        for a, b in (meeting.pair, meeting.pair[::-1]):
            if a not in held.pair or b in held.pair:
                continue
            (x,) = set(held.pair) - {a}
            if any({x, b} == set(m.pair) and m.touching[1] > end - CLOSE_S for m in overlap):
                return True
    return False

"""Meetings (contacts and couplings) between actors of a run, without those of merely carried objects."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cmp_to_key

from visup.tasks.learning.traces import LONGEST_BRIDGED_GAP_S, ActionInterval, RunTrace, Span

Pair = tuple[str, ...]
MEETINGS = ("touching", "coupled")
LATEST_END_S = 1.0
"""A meeting of a carried object ends at most this long after its carrier drew back, seconds."""
CARRIED_RUNS_SHARE = 0.5
"""A pair counts as carried along when its meetings do in more than this share of the runs."""
DETECTION_DELAY_S = 2.0
"""Tolerance for detection delays of relations, seconds: changes closer than this may belong together."""
NEAR_TIE_RATIO = 0.9
"""Pairs whose durations have a ratio above this are ranked by their motion."""
CARRIED_S = 0.5
"""Least time that coupled actors must move together for one to carry the other, seconds."""


@dataclass(frozen=True, slots=True)
class Meeting:
    """An interval in which two actors are in contact.

    Attributes:
        pair: The actors.
        touching: First to last contact.
        coupled: First to last coupling, or None when they only touch.
        begin_observed: Whether its beginning was observed, not there from the start.
        carries: Whether they move together while coupled.
    """

    pair: Pair
    touching: Span
    coupled: Span | None
    begin_observed: bool = True
    carries: bool = False

    def span(self, action: str) -> Span | None:
        """The interval of the coupling or of the contact."""
        return self.coupled if action == "coupled" else self.touching


def pairs_by_weight(runs: Sequence[RunTrace]) -> list[Pair]:
    """Pairs in contact, ascending by number of runs, then by duration; near ties: most motion first.

    An object placed on a resting one meets that one, not another placed there before.
    """
    seconds: dict[Pair, list[float]] = {}
    for run in runs:
        seconds_here: dict[Pair, float] = {}
        for interval in run.intervals:
            if interval.symbol[0] in MEETINGS:
                seconds_here[interval.symbol[1]] = (
                    seconds_here.get(interval.symbol[1], 0.0) + interval.end - interval.begin
                )
        for pair, duration in seconds_here.items():
            seconds.setdefault(pair, []).append(duration)

    def moved(pair: Pair) -> float:
        return sum(run.moved_s.get(name, 0.0) for run in runs for name in pair)

    def compared(p: Pair, q: Pair) -> int:
        runs_more, duration, other = (
            len(seconds[p]) - len(seconds[q]),
            sum(seconds[p]),
            sum(seconds[q]),
        )
        if runs_more or min(duration, other) < NEAR_TIE_RATIO * max(duration, other):
            return runs_more or (1 if duration > other else -1)
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
    meetings = [_meetings(run) for run in runs]
    for pair in pairs:
        runs_meeting = sum(any(m.pair == pair for m in row) for row in meetings)
        runs_carried = sum(
            any(m.pair == pair and _is_merely_carried(m, row, 1) for m in row) for row in meetings
        )
        if runs_carried > CARRIED_RUNS_SHARE * runs_meeting:
            # In the other runs a looser tolerance is then enough.
            meetings = [
                [m for m in r if m.pair != pair or not _is_merely_carried(m, r, 2)]
                for r in meetings
            ]
    return meetings


def _meetings(run: RunTrace) -> list[Meeting]:
    """Contacts of the same pair, separated by short breaks only, merged into one meeting."""
    found: list[list[ActionInterval]] = []
    for interval in run.intervals:
        if interval.symbol[0] not in MEETINGS:
            continue
        of_pair = [g for g in found if g[0].symbol[1] == interval.symbol[1]]
        if of_pair and interval.begin <= max(g.end for g in of_pair[-1]) + LONGEST_BRIDGED_GAP_S:
            of_pair[-1].append(interval)
        else:
            found.append([interval])
    return [_meeting(group, run) for group in found]


def _meeting(intervals: Sequence[ActionInterval], run: RunTrace) -> Meeting:
    coupled = [interval for interval in intervals if interval.symbol[0] == "coupled"]
    pair = intervals[0].symbol[1]
    coupling = (coupled[0].begin, max(interval.end for interval in coupled)) if coupled else None
    return Meeting(
        pair,
        (intervals[0].begin, max(interval.end for interval in intervals)),
        coupling,
        intervals[0].begin_observed,
        coupling is not None and _joint_motion_s(run, pair, coupling) >= CARRIED_S,
    )


def _joint_motion_s(run: RunTrace, pair: Pair, span: Span) -> float:
    """How long both of a pair moved within an interval, seconds."""
    one, other = (run.moves.get(name, ()) for name in pair)
    return sum(max(0.0, min(b, d, span[1]) - max(a, c, span[0])) for a, b in one for c, d in other)


def _is_merely_carried(meeting: Meeting, meetings: Sequence[Meeting], slack: int) -> bool:
    """Whether two meet only through a third object, which one carries and which meets the other.

    The meeting ends when the carrier has drawn back from what it carried, so that the two no longer touch,
    or up to `slack` times `LATEST_END_S` later. It may begin long before, where one overlaps the other in
    the image.
    """
    begin, end = meeting.touching
    overlap = [m for m in meetings if m.touching[0] <= end and m.touching[1] >= begin]
    for carrying in overlap:
        if not carrying.carries or end > carrying.touching[1] + slack * LATEST_END_S:
            continue
        for a, b in (meeting.pair, meeting.pair[::-1]):
            if a not in carrying.pair or b in carrying.pair:
                continue
            (other,) = set(carrying.pair) - {a}
            if any(
                {other, b} == set(m.pair) and m.touching[1] > end - DETECTION_DELAY_S
                for m in overlap
            ):
                return True
    return False

"""Final places of actors in contact, and how near actors stay that never meet.

Actors that stay in contact share about as much of their outlines in the image as in the good runs.

An object that is put down beside its place, or stops before it, may touch it in the image as well, at a
corner or a mast. Learned tasks therefore require a least shared outline in the end. In a pile each object
hides the others, by an amount that depends on the camera, so nothing is required there.

Where no actors meet, one may come, stay near the other for a while and go, as in a flight round a tower.
How near and for how long is read from the gap over time, by the largest rectangle of time and nearness.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import ceil, floor, isfinite, nan
from statistics import median

import numpy as np

from visup.agent import Mind
from visup.rules.geometry.regions import Floats
from visup.rules.predicates.outline_quantities import shared_outline
from visup.rules.predicates.snapshot import Snapshot
from visup.rules.relations.reasoner import kinematics
from visup.tasks.learning.meetings import MEETINGS, Pair
from visup.tasks.learning.order import (
    STAYING_NEAR,
    Occurrence,
    Plan,
    Proximity,
    final_of,
    leaves_of,
    symbols_of,
)
from visup.tasks.learning.relevance import CourseEvent, EventSequence
from visup.tasks.learning.traces import ActionInterval, RunTrace, Span, Symbol, names_of

MIN_SHARE_OF_GOOD = 0.7
"""A pair is elsewhere when it shares less than this part of the least shared outline in a good run.

Of rendered boats, by the median at the end of a run (five seeds), those that come alongside share 0.83 of
the least of three and more, bobbing down to 0.69; those that stop short or leave 0.62 and less, once 0.75."""
MAX_SHARED = 0.6
"""More shared outline in a good run counts as this much: 0.42 of an outline is required at most. What
lies in front of its place shares 0.45 of its outline or all of it, as the camera stands (*pick*)."""
MIN_SHARED = 0.25
"""Less shared outline in a good run than a side of a square is no evidence: only a corner or an end
touches."""
PLACED_S = 0.2
"""How long two must be elsewhere, or after a release where they belong, seconds: outlines jump while one is
half hidden."""
END_WINDOW_S = 2.0
"""Final places are measured over this long before the end of a run, seconds."""


@dataclass(frozen=True, slots=True)
class FinalPlace:
    """How much of an outline a pair in contact shares in the end.

    Attributes:
        contact: Of the pair.
        stage: The last stage.
        seen: Least share in a good run, 0 to 1.
    """

    contact: Symbol
    stage: Occurrence
    seen: float

    @property
    def least(self) -> int:
        """Least required share, in percent."""
        return floor(100 * MIN_SHARE_OF_GOOD * min(self.seen, MAX_SHARED))

    @property
    def quantity(self) -> str:
        """The shared outline, as a quantity of a task file."""
        return f"shared_outline({', '.join(self.contact[1])})"

    @property
    def of_last(self) -> bool:
        """Whether the pair meets in the last stage, so that a stage after it requires the place."""
        return self.stage[0] == self.contact

    def invariant(self, stage: str, runs: str) -> str:
        """For a pair that met before the last stage: an invariant as a line of a task file.

        Args:
            stage: Name of the last stage.
            runs: Number of supporting runs, in words.
        """
        line = f"never {self.quantity} < {self.least} % for {PLACED_S:g} s during <{stage}>"
        return f"{line}  # in {runs} at least {100 * self.seen:.0f} %"


def places_of(
    plan: Plan,
    rows: Sequence[EventSequence],
    runs: Sequence[RunTrace],
    last: Sequence[Span],
    release: Release | None = None,
) -> Iterator[FinalPlace]:
    """The final places of the pairs that stay in contact in all runs.

    Args:
        plan: The course.
        rows: The events of each run.
        runs: The runs, in the same order.
        last: When the last stage began and ended in each run, seconds.
        release: The release with which it ends.
    """
    final = final_of(plan)
    if final is None:
        return
    ends = [(run.end - END_WINDOW_S, run.end) for run in runs]
    lasting = _lasting_contacts(plan, rows)
    for occurrence, symbol in lasting:
        at_last = occurrence == final
        if not any(s != symbol and set(s[1]) & set(symbol[1]) for _, s in lasting):
            statistic = median if at_last or release is not None else min
            seen = _least_shared(runs, symbol[1], ends if at_last else last, statistic)
            if seen >= MIN_SHARED and (symbol == occurrence[0] or not at_last):
                yield FinalPlace(symbol, final, seen)


@dataclass(frozen=True, slots=True)
class Release:
    """A plan that ends with a release, and the contacts that last after it.

    The retreat is brief: it may be over before the release is believed, or lead past the other actor again in
    the image, whereas the contacts of others last.

    Attributes:
        symbol: The release.
        lasting_contacts: The contacts that last.
    """

    symbol: Symbol
    lasting_contacts: tuple[Symbol, ...]

    def spans(self, rows: Sequence[EventSequence], runs: Sequence[RunTrace]) -> list[Span]:
        """From the last release, if it was not long before, to the end of each run, seconds."""
        partings = [[e.at for e in row if e.symbol == self.symbol] for row in rows]
        return [
            (max([run.end - END_WINDOW_S, *times]), run.end)
            for times, run in zip(partings, runs, strict=True)
        ]


def release_of(plan: Plan, rows: Sequence[EventSequence]) -> Release | None:
    """The release with which a plan ends, if a retreat follows and other actors stay in contact."""
    final = final_of(plan)
    if final is None or not isinstance(final[0], tuple) or final[0][0] != "diverging":
        return None
    symbol = "decoupled", final[0][1]
    lasting = tuple(s for _, s in _lasting_contacts(plan, rows) if s[1] != symbol[1])
    required = any(symbol in symbols_of(o[0]) for o in leaves_of(plan))
    return Release(symbol, lasting) if lasting and required else None


def _lasting_contacts(plan: Plan, rows: Sequence[EventSequence]) -> list[tuple[Occurrence, Symbol]]:
    """The contacts of a plan that last to the end of all runs, each with its stage."""
    contacts = [(o, s) for o in leaves_of(plan) for s in symbols_of(o[0]) if s[0] == "touching"]
    return [(o, s) for o, s in contacts if all(_stays(row, s) for row in rows)]


def _least_shared(
    runs: Sequence[RunTrace],
    pair: Sequence[str],
    within: Sequence[Span],
    statistic: Callable[[Sequence[float]], float],
) -> float:
    """Least shared outline of a pair in any run, 0 to 1; 0 if it is unknown in some run.

    Args:
        runs: The runs.
        pair: The pair.
        within: The interval of each run, seconds.
        statistic: Of several values the one that counts: what floats bobs, and shares now more, now less.
    """
    found = [_shared_over_time(r.minds, pair, span) for r, span in zip(runs, within, strict=True)]
    return min(statistic(shares) if shares else 0.0 for shares in found)


def _stays(row: EventSequence, contact: Symbol) -> bool:
    """Whether a contact lasts to the end of a run."""
    events = [e for e in row if contact in symbols_of(e.item)]
    return bool(events) and events[-1].lasts_to_end


def _shared_over_time(minds: Sequence[Mind], pair: Sequence[str], within: Span) -> list[float]:
    """The shared outlines of a pair in an interval, 0 to 1, where both are in view."""
    found = (_shared(m, pair) for m in minds if within[0] <= m.time <= within[1])
    return [x for x in found if x is not None]


def _shared(mind: Mind, pair: Sequence[str]) -> float | None:
    numbers: Mapping[str, int] = {name: number for number, name in names_of(mind).items()}
    facts = Snapshot(mind)
    at = [facts.row[numbers[name]] for name in pair if numbers.get(name) in facts.row]
    if len(at) < len(pair):
        return None
    i, j = at
    least = float(shared_outline(facts)[0, i, j])
    return least if isfinite(least) else None


GAP_MARGIN = 1.1
"""Factor by which the gap may exceed that of all good runs."""
MIN_TIME_SHARE = 0.75
"""The required time is this share of the shortest one in a good run."""
SHORTEST_STAY_S = 2.0
"""A shorter stay is merely the turn between approach and departure, seconds."""
MAX_GAP_SHARE = 0.8
"""The gap of a stay is at most this share of the greatest gap of each good run."""
LEVELS_TRIED = 50
"""Number of gaps tried."""


def with_proximity(
    rows: Sequence[Sequence[CourseEvent]], runs: Sequence[RunTrace]
) -> list[list[CourseEvent]]:
    """The rows with approach, stay and departure for each pair that shows them in all runs, if none meet.

    Args:
        rows: The relevant events of each run, in order.
        runs: The runs, in the same order.
    """
    found = [list(row) for row in rows]
    met = [
        {interval.symbol[1] for interval in run.intervals if interval.symbol[0] in MEETINGS}
        for run in runs
    ]
    if not runs or set.intersection(*met):
        return found
    for pair in sorted(
        {interval.symbol[1] for interval in runs[0].intervals if interval.symbol[0] == "converging"}
    ):
        courses = _proximity_courses(runs, pair)
        if courses is not None:
            found = [
                sorted([*(e for e in row if e.symbol[1] != pair), *course], key=lambda e: e.at)
                for row, course in zip(found, courses, strict=True)
            ]
    return found


def _proximity_courses(runs: Sequence[RunTrace], pair: Pair) -> list[list[CourseEvent]] | None:
    """Approach, stay and departure of a pair in each run; None unless all runs show them."""
    gaps = [_gap_series(run.minds, pair) for run in runs]
    levels = [typical_gap(*g) for g in gaps]
    if not all(
        0.0 < level <= MAX_GAP_SHARE * np.nanmax(g)
        for level, (_, g) in zip(levels, gaps, strict=True)
    ):
        return None
    limit = 5 * ceil(GAP_MARGIN * max(levels) / 5)
    spans = [longest_span_below(*g, limit) for g in gaps]
    least_s = floor(2 * MIN_TIME_SHARE * min(b - a for a, b in spans)) / 2
    if least_s < SHORTEST_STAY_S:
        return None
    proximity = Proximity(pair, limit, least_s)
    found = [_proximity_course(run, span, proximity) for run, span in zip(runs, spans, strict=True)]
    return None if None in found else [course for course in found if course is not None]


def _proximity_course(run: RunTrace, span: Span, proximity: Proximity) -> list[CourseEvent] | None:
    intervals_of = {
        a: [interval for interval in run.intervals if interval.symbol == (a, proximity.pair)]
        for a in TRENDS
    }
    approaches = [interval for interval in intervals_of["converging"] if interval.begin < span[1]]
    retreats = [interval for interval in intervals_of["diverging"] if interval.end > span[1]]
    if not approaches or not retreats:
        return None
    first, last = approaches[0], retreats[-1]
    begin = max(span[0], first.begin + AFTER_S)
    staying = ActionInterval((STAYING_NEAR, proximity.pair), begin, span[1])
    return [
        CourseEvent(first, first.begin),
        CourseEvent(staying, begin, proximity=proximity),
        CourseEvent(last, max(last.begin, begin + AFTER_S)),
    ]


TRENDS = ("converging", "diverging")
AFTER_S = 1e-3
"""Offset that orders an event directly after another one, seconds."""


def _gap_series(minds: Sequence[Mind], pair: Pair) -> tuple[Floats, Floats]:
    """Times, seconds, and gaps of the outlines of a pair, pixels; NaN where unknown."""
    found = []
    for mind in minds:
        numbers = {name: number for number, name in names_of(mind).items()}
        known = all(name in numbers for name in pair)
        found.append(kinematics(mind).pair("gap", *(numbers[n] for n in pair)) if known else nan)
    return np.array([mind.time for mind in minds]), np.array(found)


def typical_gap(times: Floats, gaps: Floats) -> float:
    """The gap below which two stayed, by the largest rectangle of time and nearness; 0 if there is none.

    Args:
        times: (N,) seconds.
        gaps: (N,) pixels; NaN where unknown.
    """
    if not np.isfinite(gaps).any():
        return 0.0
    most = float(np.nanmax(gaps))
    levels = most * np.arange(1, LEVELS_TRIED) / LEVELS_TRIED
    spans = (longest_span_below(times, gaps, level) for level in levels)
    areas = [(most - level) * (b - a) for level, (a, b) in zip(levels, spans, strict=True)]
    return float(levels[int(np.argmax(areas))]) if max(areas, default=0.0) > 0.0 else 0.0


def longest_span_below(times: Floats, gaps: Floats, level: float) -> Span:
    """From when to when a gap was longest below a level, seconds; unknown gaps end it."""
    best, begin = (0.0, 0.0), None
    for time, gap in zip(times.tolist(), gaps.tolist(), strict=True):
        if not gap < level:
            begin = None
            continue
        begin = time if begin is None else begin
        best = (begin, time) if time - begin > best[1] - best[0] else best
    return best

"""Where things end up, and how near to each other those keep that never meet.

Those that stay in contact lie along each other in the image about as much as in the good runs.

What is put down beside its place, or stops before it, may touch it in the image as well, at a corner or a
mast. In the end the two must then not share far less of an outline than in any good run. In a pile each hides
the others, by more or less as the camera stands, so that nothing is asked of it.

Where nobody meets, one comes, stays near the other for a while and goes, as one who flies round a tower. How
near and for how long is read from the gap over time, by the largest rectangle of time and nearness.
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
    KEEPING,
    Keep,
    Occurrence,
    Plan,
    final_of,
    leaves_of,
    symbols_of,
)
from visup.tasks.learning.relevance import CourseEvent
from visup.tasks.learning.traces import Happening, RunTrace, Span, Symbol, names_of

FAR_LESS = 0.7
"""A pair is elsewhere when it shares less than this part of the least shared outline in a good run.

Of rendered boats, by the median at the end of a run (five seeds), those that come alongside share 0.83 of
the least of three and more, bobbing down to 0.69; those that stop short or leave 0.62 and less, once 0.75."""
MOST_SHARED = 0.6
"""More shared outline in a good run counts as this much: 0.42 of an outline is asked for at most. What
lies in front of its place shares 0.45 of its outline or all of it, as the camera stands (*pick*)."""
LEAST_SHARED = 0.25
"""Less shared outline in a good run than a side of a square tells nothing: a corner or an end meets."""
PLACED_S = 0.2
"""How long two must be elsewhere, or after a release where they belong, seconds: outlines jump while one is
half hidden."""
SETTLED_S = 2.0
"""What meets in the last stage lies where it belongs this long before the end of a run, seconds."""

Row = Sequence[CourseEvent]


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
        """Least share that is asked for, in percent."""
        return floor(100 * FAR_LESS * min(self.seen, MOST_SHARED))

    @property
    def quantity(self) -> str:
        """The shared outline, as a quantity of a task file."""
        return f"shared_outline({', '.join(self.contact[1])})"

    @property
    def of_last(self) -> bool:
        """Whether the pair meets in the last stage, so that a stage after it asks for it."""
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
    rows: Sequence[Row],
    runs: Sequence[RunTrace],
    last: Sequence[Span],
    release: Release | None = None,
) -> Iterator[FinalPlace]:
    """The places of those that meet and stay in contact in all runs.

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
    ends = [(run.end - SETTLED_S, run.end) for run in runs]
    kept = _kept_contacts(plan, rows)
    for occurrence, symbol in kept:
        at_last = occurrence == final
        if not any(s != symbol and set(s[1]) & set(symbol[1]) for _, s in kept):
            of_run = median if at_last or release is not None else min
            seen = _seen(runs, symbol[1], ends if at_last else last, of_run)
            if seen >= LEAST_SHARED and (symbol == occurrence[0] or not at_last):
                yield FinalPlace(symbol, final, seen)


@dataclass(frozen=True, slots=True)
class Release:
    """A plan that ends with a release: who has been let go, and who is in contact ever after.

    Drawing back is a motion in passing. It may be over before the release is believed, or lead past the
    other again in the image, while what others have come to by then lasts.

    Attributes:
        parted: The release.
        kept: The contacts that last.
    """

    parted: Symbol
    kept: tuple[Symbol, ...]

    def spans(self, rows: Sequence[Row], runs: Sequence[RunTrace]) -> list[Span]:
        """From the last release, if it was not long before, to the end of each run, seconds."""
        partings = [[e.at for e in row if e.symbol == self.parted] for row in rows]
        return [
            (max([run.end - SETTLED_S, *times]), run.end)
            for times, run in zip(partings, runs, strict=True)
        ]


def release_of(plan: Plan, rows: Sequence[Row]) -> Release | None:
    """The release with which a plan ends if two draw apart after it, and others stay in contact."""
    final = final_of(plan)
    if final is None or not isinstance(final[0], tuple) or final[0][0] != "diverging":
        return None
    parted = "decoupled", final[0][1]
    kept = tuple(s for _, s in _kept_contacts(plan, rows) if s[1] != parted[1])
    asked = any(parted in symbols_of(o[0]) for o in leaves_of(plan))
    return Release(parted, kept) if kept and asked else None


def _kept_contacts(plan: Plan, rows: Sequence[Row]) -> list[tuple[Occurrence, Symbol]]:
    """The contacts of a plan that last to the end of all runs, each with its stage."""
    met = [(o, s) for o in leaves_of(plan) for s in symbols_of(o[0]) if s[0] == "touching"]
    return [(o, s) for o, s in met if all(_stays(row, s) for row in rows)]


def _seen(
    runs: Sequence[RunTrace],
    pair: Sequence[str],
    within: Sequence[Span],
    of_run: Callable[[Sequence[float]], float],
) -> float:
    """Least shared outline of a pair in any run, 0 to 1; 0 if some run does not show it.

    Args:
        runs: The runs.
        pair: The pair.
        within: When to look in each run, seconds.
        of_run: Of several values the one that counts: what floats bobs, and shares now more, now less.
    """
    found = [_shares(r.minds, pair, span) for r, span in zip(runs, within, strict=True)]
    return min(of_run(shares) if shares else 0.0 for shares in found)


def _stays(row: Row, contact: Symbol) -> bool:
    """Whether a contact lasts to the end of a run."""
    mine = [e for e in row if contact in symbols_of(e.item)]
    return bool(mine) and mine[-1].lasts


def _shares(minds: Sequence[Mind], pair: Sequence[str], within: Span) -> list[float]:
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


NEARER = 1.1
"""Those that keep near may be farther from each other by this factor than in any good run."""
KEPT_SHARE = 0.75
"""They must keep near for this share of the shortest time in a good run."""
LEAST_KEPT_S = 2.0
"""A shorter time together is a turn between coming and going, seconds."""
FAR = 0.8
"""Near is at most this share of the greatest gap of every good run."""
LEVELS = 50
"""Numbers of gaps that are tried."""


def with_keeping(
    rows: Sequence[Sequence[CourseEvent]], runs: Sequence[RunTrace]
) -> list[list[CourseEvent]]:
    """The rows with coming, keeping near and going for each pair that does so in all runs, if nobody meets.

    Args:
        rows: The relevant events of each run, in order.
        runs: The runs, in the same order.
    """
    found = [list(row) for row in rows]
    met = [{h.symbol[1] for h in run.happenings if h.symbol[0] in MEETINGS} for run in runs]
    if not runs or set.intersection(*met):
        return found
    for pair in sorted({h.symbol[1] for h in runs[0].happenings if h.symbol[0] == "converging"}):
        courses = _kept_courses(runs, pair)
        if courses is not None:
            found = [
                sorted([*(e for e in row if e.symbol[1] != pair), *course], key=lambda e: e.at)
                for row, course in zip(found, courses, strict=True)
            ]
    return found


def _kept_courses(runs: Sequence[RunTrace], pair: Pair) -> list[list[CourseEvent]] | None:
    """Coming, keeping near and going of a pair in each run; None unless all runs show them."""
    gaps = [_gaps(run.minds, pair) for run in runs]
    levels = [kept_below(*g) for g in gaps]
    if not all(
        0.0 < level <= FAR * np.nanmax(g) for level, (_, g) in zip(levels, gaps, strict=True)
    ):
        return None
    below = 5 * ceil(NEARER * max(levels) / 5)
    spans = [longest_below(*g, below) for g in gaps]
    held = floor(2 * KEPT_SHARE * min(b - a for a, b in spans)) / 2
    if held < LEAST_KEPT_S:
        return None
    keep = Keep(pair, below, held)
    found = [_kept_course(run, span, keep) for run, span in zip(runs, spans, strict=True)]
    return None if None in found else [course for course in found if course is not None]


def _kept_course(run: RunTrace, span: Span, keep: Keep) -> list[CourseEvent] | None:
    spells = {a: [h for h in run.happenings if h.symbol == (a, keep.pair)] for a in GOING}
    comes = [h for h in spells["converging"] if h.begin < span[1]]
    goes = [h for h in spells["diverging"] if h.end > span[1]]
    if not comes or not goes:
        return None
    first, last = comes[0], goes[-1]
    at = max(span[0], first.begin + AFTER_S)
    near = Happening((KEEPING, keep.pair), at, span[1])
    return [
        CourseEvent(first, first.begin),
        CourseEvent(near, at, keeps=keep),
        CourseEvent(last, max(last.begin, at + AFTER_S)),
    ]


GOING = ("converging", "diverging")
AFTER_S = 1e-3
"""What follows directly is this much later, seconds."""


def _gaps(minds: Sequence[Mind], pair: Pair) -> tuple[Floats, Floats]:
    """Times, seconds, and gaps of the outlines of a pair, pixels; NaN where unknown."""
    found = []
    for mind in minds:
        numbers = {name: number for number, name in names_of(mind).items()}
        known = all(name in numbers for name in pair)
        found.append(kinematics(mind).pair("gap", *(numbers[n] for n in pair)) if known else nan)
    return np.array([mind.time for mind in minds]), np.array(found)


def kept_below(times: Floats, gaps: Floats) -> float:
    """The gap below which two kept, by the largest rectangle of time and nearness; 0 if they kept nowhere.

    Args:
        times: (N,) seconds.
        gaps: (N,) pixels; NaN where unknown.
    """
    if not np.isfinite(gaps).any():
        return 0.0
    most = float(np.nanmax(gaps))
    levels = most * np.arange(1, LEVELS) / LEVELS
    spans = (longest_below(times, gaps, level) for level in levels)
    areas = [(most - level) * (b - a) for level, (a, b) in zip(levels, spans, strict=True)]
    return float(levels[int(np.argmax(areas))]) if max(areas, default=0.0) > 0.0 else 0.0


def longest_below(times: Floats, gaps: Floats, level: float) -> Span:
    """From when to when a gap was longest below a level, seconds; unknown gaps end it."""
    best, begin = (0.0, 0.0), None
    for time, gap in zip(times.tolist(), gaps.tolist(), strict=True):
        if not gap < level:
            begin = None
            continue
        begin = time if begin is None else begin
        best = (begin, time) if time - begin > best[1] - best[0] else best
    return best

"""Where things end up: those that stay in contact overlap in the image about as much as in the good runs.

What is put down beside its place may touch it in the image as well. In the end the boxes of two that stay in
contact must then not overlap far less than in any good run. In a pile each hides the others, by more or less
as the camera stands, so that nothing is asked of it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import floor, isfinite

from visup.agent import Mind
from visup.rules.predicates.image_quantities import box_overlap
from visup.rules.predicates.snapshot import Snapshot
from visup.tasks.learning.order import Occurrence, Plan, final_of, leaves_of, symbols_of
from visup.tasks.learning.relevance import CourseEvent
from visup.tasks.learning.traces import RunTrace, Span, Symbol, names_of

FAR_LESS = 0.5
"""A pair is elsewhere when it overlaps by less than this share of the least overlap in a good run."""
LEAST_OVERLAP = 0.05
"""Less overlap in a good run, as a share of the union, tells nothing: outlines just touch."""
PLACED_S = 0.2
"""How long two must be elsewhere, seconds: boxes jump while one is half hidden."""
SETTLED_S = 2.0
"""What meets in the last stage lies where it belongs this long before the end of a run, seconds."""


@dataclass(frozen=True, slots=True)
class FinalOverlap:
    """How much a pair in contact overlaps in the end.

    Attributes:
        contact: Of the pair.
        stage: The last stage.
        seen: Least overlap in a good run, 0 to 1.
    """

    contact: Symbol
    stage: Occurrence
    seen: float

    @property
    def least(self) -> int:
        """Least overlap that is asked for, in percent."""
        return floor(100 * FAR_LESS * self.seen)

    @property
    def quantity(self) -> str:
        """The overlap, as a quantity of a task file."""
        return f"overlap({', '.join(self.contact[1])})"

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
    rows: Sequence[Sequence[CourseEvent]],
    runs: Sequence[RunTrace],
    last: Sequence[Span],
) -> Iterator[FinalOverlap]:
    """The places of those that meet and stay in contact in all runs.

    Args:
        plan: The course.
        rows: The events of each run.
        runs: The runs, in the same order.
        last: When the last stage began and ended in each run, seconds.
    """
    final = final_of(plan)
    if final is None:
        return
    ends = [(run.end - SETTLED_S, run.end) for run in runs]
    kept = [(o, s) for o in leaves_of(plan) for s in symbols_of(o[0]) if s[0] == "touching"]
    kept = [(o, s) for o, s in kept if all(_stays(row, s) for row in rows)]
    for occurrence, symbol in kept:
        at_last = occurrence == final
        if not any(s != symbol and set(s[1]) & set(symbol[1]) for _, s in kept):
            seen = _least_seen(runs, symbol[1], ends if at_last else last)
            if seen >= LEAST_OVERLAP and (symbol == occurrence[0] or not at_last):
                yield FinalOverlap(symbol, final, seen)


def _least_seen(runs: Sequence[RunTrace], pair: Sequence[str], within: Sequence[Span]) -> float:
    """Least overlap of a pair in any run, 0 to 1; 0 if some run does not show it."""
    least = [_least_overlap(r.minds, pair, span) for r, span in zip(runs, within, strict=True)]
    return min(x or 0.0 for x in least)


def _stays(row: Sequence[CourseEvent], contact: Symbol) -> bool:
    """Whether a contact lasts to the end of a run."""
    mine = [e for e in row if contact in symbols_of(e.item)]
    return bool(mine) and mine[-1].lasts


def _least_overlap(minds: Sequence[Mind], pair: Sequence[str], within: Span) -> float | None:
    """Least overlap of a pair in an interval, 0 to 1; None if one of them was never in view."""
    found = (_overlap(m, pair) for m in minds if within[0] <= m.time <= within[1])
    return min((x for x in found if x is not None), default=None)


def _overlap(mind: Mind, pair: Sequence[str]) -> float | None:
    numbers: Mapping[str, int] = {name: number for number, name in names_of(mind).items()}
    facts = Snapshot(mind)
    at = [facts.row[numbers[name]] for name in pair if numbers.get(name) in facts.row]
    if len(at) < len(pair):
        return None
    i, j = at
    least = float(box_overlap(facts)[0, i, j])
    return least if isfinite(least) else None

"""What repeats in time: loops of one kind of meeting that keep a rhythm, though how often differs.

How often a wiper touches the glass is chance, that it does so every two to four seconds is not: then the
rhythm is what the runs have in common, and describes them all with two numbers.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from math import ceil, floor

from visup.tasks.learning.meetings import MEETINGS
from visup.tasks.learning.order import Loop, Times
from visup.tasks.learning.relevance import CourseEvent
from visup.tasks.learning.traces import Symbol

LEAST_BEATS = 4
"""Fewer in a run keep no rhythm that could be told from chance."""
STEADIEST, EVEN = 0.25, 2.0
"""The longest time from one to the next is at most so many times the shortest; of shorter steps than so many
seconds nothing is told."""
MARGIN = 1.5
"""The next one may come so many times as late as ever in a good run, or as early."""

Period = tuple[float, float]
"""The least and the greatest time from one beginning to the next, seconds."""


def periods_of(times: Times, rows: Sequence[Sequence[CourseEvent]]) -> dict[Loop, Period]:
    """The loops that keep a rhythm, with their periods as they were in the runs.

    Args:
        times: Of each loop, how often it was gone through.
        rows: What each run is made of.
    """
    found: dict[Loop, Period] = {}
    for loop, (least, most) in times.items():
        beat = beat_of(loop)
        steps = [_steps(row, beat) for row in rows] if beat and least != most else []
        every = [s for row in steps for s in row]
        if not every or min(map(len, steps)) < LEAST_BEATS - 1:
            continue
        if max(every) <= EVEN * min(every) and min(every) >= STEADIEST:
            found[loop] = (min(every), max(every))
    return found


def beat_of(loop: Loop) -> Symbol | None:
    """The meeting of which a loop is made: one, of one pair, with what leads to it and its end; else None."""
    symbols = [s for s in loop.body if isinstance(s, tuple)]
    meetings = [s for s in symbols if s[0] in MEETINGS]
    alone = len(symbols) == len(loop.body) and len({s[1] for s in symbols}) == 1
    return meetings[0] if alone and len(meetings) == 1 else None


def with_margin(period: Period) -> Period:
    """A period with a margin, in half seconds."""
    least, most = period[0] / MARGIN, period[1] * MARGIN
    return floor(2 * least) / 2, ceil(2 * most) / 2


def course_of(loop: Loop, period: Period) -> str:
    """What a stage asks for that keeps a rhythm, with how it was in the runs."""
    least, most = with_margin(period)
    said = f"{least:g} s to {most:g} s" if least else f"{most:g} s"
    action, actors = beat_of(loop) or ("", ())
    return (
        f"{action}({', '.join(actors)}) every {said}  # every {period[0]:.1f} to {period[1]:.1f} s"
    )


def _steps(row: Sequence[CourseEvent], beat: Symbol) -> list[float]:
    begins = [e.happening.begin for e in row if e.symbol == beat]
    return [b - a for a, b in pairwise(begins)]

"""Periodic loops: one kind of meeting repeated at a regular period, though a varying number of times.

How often a wiper touches the glass is random, but that it does so every two to four seconds is not. The
period is then common to the runs and describes all of them with two numbers.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from math import ceil, floor

from visup.tasks.learning.meetings import MEETINGS
from visup.tasks.learning.order import Loop, LoopCounts
from visup.tasks.learning.relevance import CourseEvent
from visup.tasks.learning.traces import Symbol

MIN_REPETITIONS = 4
"""Fewer repetitions in a run cannot be told from chance."""
SHORTEST_PERIOD_S, MAX_PERIOD_RATIO = 0.25, 2.0
"""Shortest period that is accepted, seconds, and greatest ratio of the longest to the shortest one."""
MARGIN = 1.5
"""Factor by which a period may exceed the extremes of the good runs, either way."""

Period = tuple[float, float]
"""Shortest and longest time from one beginning to the next, seconds."""


def periods_of(times: LoopCounts, rows: Sequence[Sequence[CourseEvent]]) -> dict[Loop, Period]:
    """The periodic loops, with their periods in the runs.

    Args:
        times: Least and greatest number of iterations of each loop.
        rows: The events of each run.
    """
    found: dict[Loop, Period] = {}
    for loop, (least, most) in times.items():
        meeting = repeated_meeting(loop)
        steps = [_steps(row, meeting) for row in rows] if meeting and least != most else []
        all_steps = [s for row in steps for s in row]
        if not all_steps or min(map(len, steps)) < MIN_REPETITIONS - 1:
            continue
        if (
            max(all_steps) <= MAX_PERIOD_RATIO * min(all_steps)
            and min(all_steps) >= SHORTEST_PERIOD_S
        ):
            found[loop] = (min(all_steps), max(all_steps))
    return found


def repeated_meeting(loop: Loop) -> Symbol | None:
    """The meeting of a loop that is one meeting of one pair, with its approach and end; else None."""
    symbols = [s for s in loop.body if isinstance(s, tuple)]
    meetings = [s for s in symbols if s[0] in MEETINGS]
    single_pair = len(symbols) == len(loop.body) and len({s[1] for s in symbols}) == 1
    return meetings[0] if single_pair and len(meetings) == 1 else None


def with_margin(period: Period) -> Period:
    """A period widened by the margin, in half seconds."""
    least, most = period[0] / MARGIN, period[1] * MARGIN
    return floor(2 * least) / 2, ceil(2 * most) / 2


def course_of(loop: Loop, period: Period) -> str:
    """The body of a periodic stage, with the observed period as a comment."""
    least, most = with_margin(period)
    bounds = f"{least:g} s to {most:g} s" if least else f"{most:g} s"
    action, actors = repeated_meeting(loop) or ("", ())
    return f"{action}({', '.join(actors)}) every {bounds}  # every {period[0]:.1f} to {period[1]:.1f} s"


def _steps(row: Sequence[CourseEvent], meeting: Symbol) -> list[float]:
    begins = [e.interval.begin for e in row if e.symbol == meeting]
    return [b - a for a, b in pairwise(begins)]

"""Which of several in one run is the one that all runs share: rows of events laid side by side.

A grasp that is lost from sight for a moment, and seen again, makes two of it in that run. The longest course
that a run has in common with the plainest one tells which of them is meant; the others are noise.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from visup.tasks.learning.order import Item
from visup.tasks.learning.relevance import CourseEvent

Row = Sequence[CourseEvent]


def aligned(rows: Sequence[Row]) -> list[list[CourseEvent]]:
    """The rows without what is there more often than in the run that has it least often, but has it.

    Args:
        rows: Of each run its events, in order.
    """
    if not rows:
        return []
    counts = [Counter(e.item for e in row) for row in rows]
    least = {item: min(c[item] for c in counts) for item in set().union(*counts)}
    plainest = [e.item for e in min(rows, key=len)]
    return [_without_noise(row, plainest, least) for row in rows]


def _without_noise(row: Row, plainest: Sequence[Item], least: dict[Item, int]) -> list[CourseEvent]:
    """One row in which nothing that all have is there more often than it must be."""
    items = [e.item for e in row]
    shared = set(longest_common(items, plainest))
    kept: set[int] = set()
    for item, count in least.items():
        places = [k for k, i in enumerate(items) if i == item]
        # Those in common first, and of the others the earliest.
        ranked = sorted(places, key=lambda k: (k not in shared, k))
        kept.update(ranked[:count] if count else places)
    return [e for k, e in enumerate(row) if k in kept]


def longest_common(one: Sequence[Item], other: Sequence[Item]) -> list[int]:
    """Places in the first of the longest course that both have; of several the one that begins soonest."""
    best = [[0] * (len(other) + 1) for _ in range(len(one) + 1)]
    for i in reversed(range(len(one))):
        for j in reversed(range(len(other))):
            same = one[i] == other[j]
            best[i][j] = 1 + best[i + 1][j + 1] if same else max(best[i + 1][j], best[i][j + 1])
    found, i, j = [], 0, 0
    while i < len(one) and j < len(other):
        if one[i] == other[j]:
            found.append(i)
            i, j = i + 1, j + 1
        elif best[i + 1][j] >= best[i][j + 1]:
            i += 1
        else:
            j += 1
    return found

"""Sequence alignment of runs: removes repeated events that not all runs share.

A grasp that is lost for a moment and detected again yields two events. The longest common subsequence with
the shortest run tells which of them to keep; the others are noise.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from visup.tasks.learning.order import Item
from visup.tasks.learning.relevance import CourseEvent, EventSequence


def with_common_counts(rows: Sequence[EventSequence]) -> list[list[CourseEvent]]:
    """The rows with each item reduced to its lowest count over all runs, unless that is zero.

    Args:
        rows: The events of each run, in order.
    """
    if not rows:
        return []
    counts = [Counter(e.item for e in row) for row in rows]
    least = {item: min(c[item] for c in counts) for item in set().union(*counts)}
    shortest = [e.item for e in min(rows, key=len)]
    return [_with_least_counts(row, shortest, least) for row in rows]


def _with_least_counts(
    row: EventSequence, shortest: Sequence[Item], least: dict[Item, int]
) -> list[CourseEvent]:
    """One row with each item that all runs have reduced to its least count."""
    items = [e.item for e in row]
    common = set(longest_common_subsequence(items, shortest))
    selected: set[int] = set()
    for item, count in least.items():
        places = [k for k, i in enumerate(items) if i == item]
        # Items of the common subsequence first, then the earliest.
        ranked = sorted(places, key=lambda k: (k not in common, k))
        selected.update(ranked[:count] if count else places)
    return [e for k, e in enumerate(row) if k in selected]


def longest_common_subsequence(one: Sequence[Item], other: Sequence[Item]) -> list[int]:
    """Indices in the first sequence of the longest common subsequence; the earliest of several."""
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

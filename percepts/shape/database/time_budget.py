"""A budget in time as an amount of work: what may be compared in so many milliseconds.

What a step costs is told by constants, measured once (docs/benchmarks.md), never by a clock: a run must
repeat, whatever else the machine does. A search looks at the likeliest views first, so that a small
budget loses the unlikely ones.
"""

from __future__ import annotations

SHAPE_MS = 3.0
"""From a mask to its shock graph."""

SEARCH_MS = 2.0
"""The sieves of the index, and what comes after the comparisons."""

VIEW_MS = 0.35
"""A view compared in full."""


def share_within(milliseconds: float, views: int) -> float:
    """Share of a database's views that one silhouette may be compared with in so many milliseconds.

    Args:
        milliseconds: For the silhouette, from mask to ranking.
        views: Of the database, at least 1.

    Returns:
        Above 0, whatever the budget: something is always compared.

    Example:
        >>> share_within(12.0, 1000), share_within(0.0, 1000)
        (0.02, 0.001)
    """
    left = milliseconds - SHAPE_MS - SEARCH_MS
    return max(1.0, left / VIEW_MS) / max(1, views)

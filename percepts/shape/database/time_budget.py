"""A time budget converted to an amount of work: how many views may be compared.

Costs are constants, measured once (docs/benchmarks.md), never a clock: a run must be reproducible whatever
else the machine does. A search compares the likeliest views first, so a small budget loses the unlikely
ones.
"""

from __future__ import annotations

SHAPE_MS = 3.0
"""From a mask to its shock graph."""

SEARCH_MS = 2.0
"""The index, and the work after the comparisons."""

VIEW_MS = 0.35
"""One view compared in full."""


def share_within(milliseconds: float, views: int) -> float:
    """Share of a database's views that one silhouette may be compared with in a time budget.

    Args:
        milliseconds: For the silhouette, from mask to ranking.
        views: Number of views in the database, at least 1.

    Returns:
        Above 0, whatever the budget: something is always compared.

    Example:
        >>> share_within(12.0, 1000), share_within(0.0, 1000)
        (0.02, 0.001)
    """
    comparison_ms = milliseconds - SHAPE_MS - SEARCH_MS
    return max(1.0, comparison_ms / VIEW_MS) / max(1, views)

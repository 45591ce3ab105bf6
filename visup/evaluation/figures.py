"""Helpers of all evaluations: progress, means over items, memory."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

Progress = Callable[[str], None]
"""Shows, as a line of text, what is being done."""


def silent(text: str) -> None:
    """A `Progress` that shows nothing."""


def mean_of(items: Sequence[Mapping[str, Any]], key: str) -> float | None:
    """Mean of one figure over the items that have it, or None."""
    values = [item[key] for item in items if key in item]
    return sum(values) / len(values) if values else None


def sums_of(items: Sequence[Mapping[str, Any]], keys: Iterable[str]) -> dict[str, Any]:
    """Sums of figures over all items, by key."""
    return {key: sum(item[key] for item in items) for key in keys}


def resident_mb() -> float:
    """Resident memory of this process, megabytes."""
    try:
        pages = int(Path("/proc/self/statm").read_text().split()[1])
    except OSError:  # not Linux: the peak
        import resource

        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20

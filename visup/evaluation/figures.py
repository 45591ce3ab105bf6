"""Helpers of all evaluations: progress, means over items, parallel processing, memory."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from pathlib import Path
from typing import Any, TypeVar

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


Item = TypeVar("Item")
Found = TypeVar("Found")


def each_in_processes(
    work: Callable[[Item], Found], items: Sequence[Item], workers: int
) -> Iterator[tuple[Item, Found]]:
    """Each item with its result, in order of completion; in this process with a single worker.

    Args:
        work: A module-level function, which is pickled.
        items: Its arguments.
        workers: Worker processes.
    """
    if min(workers, len(items)) <= 1:
        yield from ((item, work(item)) for item in items)
        return
    # Fresh processes: a fork would share the state of OpenCV's threads.
    with ProcessPoolExecutor(workers, get_context("spawn"), _alone) as pool:
        todo = {pool.submit(work, item): item for item in items}
        for done in as_completed(todo):
            yield todo[done], done.result()


def _alone() -> None:
    """Limit each process to one thread: the processes share the cores already."""
    import cv2

    cv2.setNumThreads(1)


def resident_mb() -> float:
    """Resident memory of this process, megabytes."""
    try:
        pages = int(Path("/proc/self/statm").read_text().split()[1])
    except OSError:  # not Linux: the peak
        import resource

        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20

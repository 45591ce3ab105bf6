"""What every evaluation needs: showing its progress, means over items, the memory of the process."""

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
    """Mean of one figure over the items that have it, or None when none has."""
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
    """Each item with what was made of it, as they come; in this process where one worker does.

    Args:
        work: A function of a module; it is sent to other processes.
        items: What to do.
        workers: Processes that share the work.
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
    """One thread for each process: the processes share the cores already."""
    import cv2

    cv2.setNumThreads(1)


def resident_mb() -> float:
    """Resident memory of this process, megabytes."""
    try:
        pages = int(Path("/proc/self/statm").read_text().split()[1])
    except OSError:  # not Linux: the most that it ever was
        import resource

        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20

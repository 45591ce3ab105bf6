"""Maps a function over many runs in several processes, in order."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from typing import Annotated, TypeVar

from visup.runs.settings import Option

WORTH_IT = 8
"""Fewer runs are done before worker processes would have started."""
Item = TypeVar("Item")
Found = TypeVar("Found")
Workers = Annotated[
    int | None,
    Option("Worker processes; 0 to use none (default: one per core).", at_least=0),
]


def each_run(
    work: Callable[[Item], Found], items: Sequence[Item], workers: int | None = None
) -> Iterator[Found]:
    """The result of each item, in order.

    Args:
        work: A module-level function, which is pickled.
        items: Its arguments.
        workers: Worker processes; None for one per core if there are enough items.
    """
    count = (os.cpu_count() or 1) if workers is None else workers
    if count <= 1 or (workers is None and len(items) < WORTH_IT):
        yield from map(work, items)
        return
    # Every command loads this module, for `Workers`: these two take a tenth of the time to start.
    from concurrent.futures import ProcessPoolExecutor
    from multiprocessing import get_context

    with ProcessPoolExecutor(count, get_context("spawn"), _single_threaded) as pool:
        try:
            yield from pool.map(work, items)
        finally:
            pool.shutdown(wait=False, cancel_futures=True)


def _single_threaded() -> None:
    """Limit each process to one thread: the processes share the cores already."""
    import cv2

    cv2.setNumThreads(1)

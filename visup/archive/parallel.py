"""Many runs looked into by several processes, in the order in which they were asked for."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from typing import Annotated, TypeVar

from visup.runs.settings import Option

WORTH_IT = 8
"""Fewer runs are done before other processes have begun."""
Item = TypeVar("Item")
Found = TypeVar("Found")
Workers = Annotated[
    int | None,
    Option("Worker processes; 0 to use none (default: one per core).", at_least=0),
]


def each_run(
    work: Callable[[Item], Found], items: Sequence[Item], workers: int | None = None
) -> Iterator[Found]:
    """What is made of each item, in their order.

    Args:
        work: A function of a module; it is sent to other processes.
        items: What to do.
        workers: Processes; None for one for each core, where it is worth it.
    """
    wanted = (os.cpu_count() or 1) if workers is None else workers
    if wanted <= 1 or (workers is None and len(items) < WORTH_IT):
        yield from map(work, items)
        return
    with ProcessPoolExecutor(wanted, get_context("spawn"), _alone) as pool:
        try:
            yield from pool.map(work, items)
        finally:
            pool.shutdown(wait=False, cancel_futures=True)


def _alone() -> None:
    """One thread for each process: the processes share the cores already."""
    import cv2

    cv2.setNumThreads(1)

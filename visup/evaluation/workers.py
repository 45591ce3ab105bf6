"""Worker processes of evaluations: fresh ones, of one thread each, that end with their parent."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context, parent_process
from typing import Any, TypeVar

Item = TypeVar("Item")
Result = TypeVar("Result")


def worker_pool(
    workers: int, prepare: Callable[..., None] | None = None, *arguments: Any
) -> ProcessPoolExecutor:
    """A pool of processes; a fork would share the state of OpenCV's threads.

    Args:
        workers: How many.
        prepare: Called first in each, or None; a module-level function, which is pickled.
        *arguments: Its arguments.
    """
    initargs = (prepare, arguments)
    return ProcessPoolExecutor(workers, get_context("spawn"), _initialise, initargs)


def each_in_processes(
    work: Callable[[Item], Result], items: Sequence[Item], workers: int
) -> Iterator[tuple[Item, Result]]:
    """Each item with its result, in order of completion; in this process with a single worker.

    Args:
        work: A module-level function, which is pickled.
        items: Its arguments.
        workers: Worker processes.
    """
    workers = min(workers, len(items))
    if workers <= 1:
        yield from ((item, work(item)) for item in items)
        return
    with worker_pool(workers) as pool:
        pending = {pool.submit(work, item): item for item in items}
        for future in as_completed(pending):
            yield pending[future], future.result()


def _initialise(prepare: Callable[..., None] | None, arguments: Sequence[Any]) -> None:
    import cv2

    cv2.setNumThreads(1)  # the processes share the cores already
    threading.Thread(target=_end_with_parent, daemon=True).start()
    if prepare is not None:
        prepare(*arguments)


def _end_with_parent() -> None:
    """End this process as soon as its parent is gone: nobody would take its results."""
    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)

"""Executors for the parts of a frame that can be computed in parallel: a second thread, or none."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from typing import ParamSpec, TypeVar

import cv2

P = ParamSpec("P")
T = TypeVar("T")


class InlineExecutor(Executor):
    """Runs each call at once, in the thread that submits it."""

    def submit(self, fn: Callable[P, T], /, *args: P.args, **kwargs: P.kwargs) -> Future[T]:
        """Run a call, and return its finished future, with the result or the exception."""
        future: Future[T] = Future()
        try:
            future.set_result(fn(*args, **kwargs))
        except Exception as fault:
            future.set_exception(fault)
        return future


def second_core() -> Executor:
    """An executor with one thread; without a thread if OpenCV is limited to one (`cv2.setNumThreads(1)`).

    Such a process has one core to itself, and a second thread would take time from other processes.
    The results are the same.
    """
    if cv2.getNumThreads() == 1:
        return InlineExecutor()
    return ThreadPoolExecutor(max_workers=1, thread_name_prefix="motion")

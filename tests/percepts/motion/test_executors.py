"""Calls give the same whether a second thread runs them or none."""

from __future__ import annotations

from collections.abc import Iterator

import cv2
import pytest

from visup.percepts.motion.executors import InlineExecutor, second_core


@pytest.fixture(autouse=True)
def _same_threads_afterwards() -> Iterator[None]:
    before = cv2.getNumThreads()
    yield
    cv2.setNumThreads(before)


@pytest.mark.parametrize("threads", [1, 2])
def test_calls_give_their_results_and_their_faults(threads: int) -> None:
    cv2.setNumThreads(threads)
    with second_core() as executor:
        assert executor.submit(divmod, 7, 2).result() == (3, 1)
        assert list(executor.map(abs, [-1, 2])) == [1, 2]
        with pytest.raises(ZeroDivisionError):
            executor.submit(divmod, 7, 0).result()


def test_a_process_limited_to_one_core_has_no_second_thread() -> None:
    cv2.setNumThreads(1)
    assert isinstance(second_core(), InlineExecutor)
    cv2.setNumThreads(2)
    assert not isinstance(second_core(), InlineExecutor)

"""Worker processes give the same results as a single process, and end with their parent."""

from __future__ import annotations

import os
import subprocess
import sys
import time

import pytest

from visup.evaluation.workers import each_in_processes, worker_pool


def square(n: int) -> int:
    return n * n


@pytest.mark.parametrize("workers", [1, 2])
def test_results_do_not_depend_on_the_number_of_workers(workers: int) -> None:
    results = dict(each_in_processes(square, range(7), workers))
    assert results == {n: n * n for n in range(7)}


_PREPARED: list[int] = []


def _prepare(number: int) -> None:
    _PREPARED.append(number)


def _prepared(_: int) -> list[int]:
    return _PREPARED


def test_workers_are_prepared_once() -> None:
    with worker_pool(1, _prepare, 5) as pool:
        assert list(pool.map(_prepared, range(3))) == [[5]] * 3


def process_id(_: int) -> int:
    time.sleep(0.2)
    return os.getpid()


def hold_workers() -> None:
    """Run by the test below in a process that is killed."""
    with worker_pool(2) as pool:
        print(*set(pool.map(process_id, range(4))), flush=True)
        time.sleep(60)


def test_workers_end_when_their_parent_is_killed() -> None:
    """The pipe that all of them write to ends when the last of them has ended."""
    code = "from tests.evaluation.test_workers import hold_workers; hold_workers()"
    with subprocess.Popen(
        [sys.executable, "-c", code], stdout=subprocess.PIPE, text=True
    ) as parent:
        assert parent.stdout is not None
        assert parent.stdout.readline().split()
        parent.kill()
        parent.communicate(timeout=20)

"""Capacity of a Dask scheduler, estimated with sleeping workers.

One process can host a hundred sleeping workers; the scheduler, in a separate process, treats them like any
others. Its measured load, idle and per job, is extrapolated to the requested workers and clips, considering
that Dask reduces the heartbeat rate with many workers.
"""

from __future__ import annotations

import asyncio
import re
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import count
from typing import Any

from visup.archive.extra import imported
from visup.evaluation.figures import Progress

IDLE_S = 10.0
ASKED_WORKERS = 1_000
MOST_BUSY = 0.6
ASKED_CLIPS = 100_000
CLIP_S = 60.0
"""Time of a worker per clip: a minute of video in real time."""
WAITING_PER_WORKER = 3
_WORKERS = "from visup.evaluation.archive.scheduling import sleepers; sleepers('{}', {})"
_ADDRESS = re.compile(rb"tcp://[\d.]+:\d+")


def measure_scheduler(workers: int, jobs: int, progress: Progress) -> dict[str, Any]:
    """Measure the load of a scheduler.

    Args:
        workers: Number of sleeping workers.
        jobs: Number of jobs.
        progress: Shows what is being done.

    Returns:
        `workers` and `jobs`; processor time `beat_ms` per heartbeat and `job_ms` per job; `busy`, the share
        of a core with 1,000 workers and a minute per clip; `breaks_at`, the number of workers at 60 % load;
        `hours` for 100,000 clips.
    """
    distributed, psutil = imported("distributed"), imported("psutil")
    with (
        _scheduler() as (process, address),
        _sleeping(address, workers),
        distributed.Client(address, timeout=30) as client,
    ):
        client.wait_for_workers(workers, timeout=120)
        progress("idle")
        idle = _taken(psutil.Process(process), lambda: time.sleep(IDLE_S))
        progress("working")
        seconds, took = _timed(psutil.Process(process), client, jobs, workers)
    interval = imported("distributed.scheduler").heartbeat_interval
    beat = idle / IDLE_S / workers * interval(workers)
    job = max(0.0, took - idle / IDLE_S * seconds) / jobs

    def busy(of: int) -> float:
        return of * float(beat / interval(of) + job / CLIP_S)

    return {
        "workers": workers,
        "jobs": jobs,
        "beat_ms": 1e3 * beat,
        "job_ms": 1e3 * job,
        "busy": busy(ASKED_WORKERS),
        "breaks_at": next(n for n in count(100, 100) if busy(n) > MOST_BUSY),
        "hours": ASKED_CLIPS * CLIP_S / ASKED_WORKERS / 3600,
    }


def _timed(process: Any, client: Any, jobs: int, workers: int) -> tuple[float, float]:
    """Elapsed seconds of some jobs, and processor seconds of the scheduler."""
    begin = time.perf_counter()
    took = _taken(process, lambda: _run_jobs(client, jobs, workers))
    return time.perf_counter() - begin, took


def _taken(process: Any, work: Any) -> float:
    """Processor seconds of a process during some work."""
    before = process.cpu_times()
    work()
    after = process.cpu_times()
    return float(after.user + after.system - before.user - before.system)


def _run_jobs(client: Any, jobs: int, workers: int) -> None:
    """Submit jobs like those of a lake: a few per worker, and one more for each completed."""
    completed = imported("distributed").as_completed()
    left = iter(range(jobs))
    for _, number in zip(range(workers * WAITING_PER_WORKER), left, strict=False):
        completed.add(client.submit(time.sleep, 2.0, key=f"job-{number}", pure=False))
    for _ in completed:
        number = next(left, -1)
        if number >= 0:
            completed.add(client.submit(time.sleep, 2.0, key=f"job-{number}", pure=False))


@contextmanager
def _scheduler() -> Iterator[tuple[int, str]]:
    words = [sys.executable, "-m", "distributed.cli.dask_scheduler"]
    where = ["--host", "127.0.0.1", "--port", "0", "--no-dashboard"]
    with subprocess.Popen([*words, *where], stderr=subprocess.PIPE) as process:
        try:
            assert process.stderr is not None
            found = next(filter(None, map(_ADDRESS.search, process.stderr)))
            yield process.pid, found.group().decode()
        finally:
            process.kill()


@contextmanager
def _sleeping(address: str, workers: int) -> Iterator[None]:
    """Start sleeping workers in a process."""
    code = _WORKERS.format(address, workers)
    with subprocess.Popen([sys.executable, "-c", code], stderr=subprocess.DEVNULL) as process:
        try:
            yield
        finally:
            process.kill()


def sleepers(address: str, workers: int) -> None:
    """Run workers of one thread each until the process is ended."""
    asyncio.run(_sleepers(address, workers))


async def _sleepers(address: str, workers: int) -> None:
    kind = imported("distributed").Worker
    made = [
        kind(address, nthreads=1, memory_limit=0, dashboard=False, name=f"sleeper-{n}")
        for n in range(workers)
    ]
    for worker in made:
        await worker
    await asyncio.gather(*(worker.finished() for worker in made))

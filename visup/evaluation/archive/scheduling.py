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
TARGET_WORKERS = 1_000
MAX_LOAD = 0.6
TARGET_CLIPS = 100_000
CLIP_S = 60.0
"""Time of a worker per clip: a minute of video in real time."""
QUEUED_PER_WORKER = 3
_WORKER_CODE = "from visup.evaluation.archive.scheduling import sleepers; sleepers('{}', {})"
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
        _sleeping_workers(address, workers),
        distributed.Client(address, timeout=30) as client,
    ):
        client.wait_for_workers(workers, timeout=120)
        progress("idle")
        idle_cpu_s = _cpu_seconds(psutil.Process(process), lambda: time.sleep(IDLE_S))
        progress("working")
        seconds, busy_cpu_s = _time_jobs(psutil.Process(process), client, jobs, workers)
    interval = imported("distributed.scheduler").heartbeat_interval
    heartbeat_s = idle_cpu_s / IDLE_S / workers * interval(workers)
    job_s = max(0.0, busy_cpu_s - idle_cpu_s / IDLE_S * seconds) / jobs

    def load(worker_count: int) -> float:
        return worker_count * float(heartbeat_s / interval(worker_count) + job_s / CLIP_S)

    return {
        "workers": workers,
        "jobs": jobs,
        "beat_ms": 1e3 * heartbeat_s,
        "job_ms": 1e3 * job_s,
        "busy": load(TARGET_WORKERS),
        "breaks_at": next(count_ for count_ in count(100, 100) if load(count_) > MAX_LOAD),
        "hours": TARGET_CLIPS * CLIP_S / TARGET_WORKERS / 3600,
    }


def _time_jobs(process: Any, client: Any, jobs: int, workers: int) -> tuple[float, float]:
    """Elapsed seconds of some jobs, and processor seconds of the scheduler."""
    begin = time.perf_counter()
    cpu_s = _cpu_seconds(process, lambda: _run_jobs(client, jobs, workers))
    return time.perf_counter() - begin, cpu_s


def _cpu_seconds(process: Any, work: Any) -> float:
    """Processor seconds of a process during some work."""
    before = process.cpu_times()
    work()
    after = process.cpu_times()
    return float(after.user + after.system - before.user - before.system)


def _run_jobs(client: Any, jobs: int, workers: int) -> None:
    """Submit jobs like those of a lake: a few per worker, and one more for each completed."""
    completed = imported("distributed").as_completed()
    numbers = iter(range(jobs))
    for _, number in zip(range(workers * QUEUED_PER_WORKER), numbers, strict=False):
        completed.add(client.submit(time.sleep, 2.0, key=f"job-{number}", pure=False))
    for _ in completed:
        number = next(numbers, -1)
        if number >= 0:
            completed.add(client.submit(time.sleep, 2.0, key=f"job-{number}", pure=False))


@contextmanager
def _scheduler() -> Iterator[tuple[int, str]]:
    command = [sys.executable, "-m", "distributed.cli.dask_scheduler"]
    options = ["--host", "127.0.0.1", "--port", "0", "--no-dashboard"]
    with subprocess.Popen([*command, *options], stderr=subprocess.PIPE) as process:
        try:
            assert process.stderr is not None
            match = next(filter(None, map(_ADDRESS.search, process.stderr)))
            yield process.pid, match.group().decode()
        finally:
            process.kill()


@contextmanager
def _sleeping_workers(address: str, workers: int) -> Iterator[None]:
    """Start sleeping workers in a process."""
    code = _WORKER_CODE.format(address, workers)
    with subprocess.Popen([sys.executable, "-c", code], stderr=subprocess.DEVNULL) as process:
        try:
            yield
        finally:
            process.kill()


def sleepers(address: str, workers: int) -> None:
    """Run workers of one thread each until the process is ended."""
    asyncio.run(_serve_sleeping_workers(address, workers))


async def _serve_sleeping_workers(address: str, workers: int) -> None:
    worker_class = imported("distributed").Worker
    started = [
        worker_class(address, nthreads=1, memory_limit=0, dashboard=False, name=f"sleeper-{n}")
        for n in range(workers)
    ]
    for worker in started:
        await worker
    await asyncio.gather(*(worker.finished() for worker in started))

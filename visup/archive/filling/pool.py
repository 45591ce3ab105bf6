"""Jobs on workers: in this process, or on those of Dask, here or on a cluster.

Dask runs a job again elsewhere when its worker dies; the marks of `attempts.py` see to it that a clip which
ends its workers is given up after two, whatever the scheduler allows. Only a few jobs for each worker are
handed over at a time, so that a scheduler never holds a hundred thousand of them.
"""

from __future__ import annotations

import logging
import multiprocessing
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.util import find_spec
from typing import Any

from visup.agent.execution.runners import error_line
from visup.agent.model.errors import SettingsError
from visup.archive.extra import imported
from visup.archive.filling.attempts import Attempts
from visup.archive.filling.plan import FailedClip, Job, put_aside
from visup.archive.filling.pool_settings import PoolSettings
from visup.archive.filling.watching import ClipOutcome, Watch, watch_into, watch_job
from visup.archive.lake import Lake

WAITING_PER_WORKER = 3
"""Jobs handed over for each worker: while one is watched, the next is there."""
CONNECT_S = 20
MOST_RESUBMISSIONS = 5


@dataclass(frozen=True, slots=True)
class Pool:
    """Workers that are there.

    Attributes:
        client: Of Dask, or None for this process.
        dashboard: Address of Dask's dashboard, or None.
    """

    client: Any = None
    dashboard: str | None = None

    def outcomes(
        self, lake: Lake, jobs: Sequence[Job], watch: Watch = watch_into
    ) -> Iterator[ClipOutcome]:
        """Run jobs and give what becomes of each, in the order in which they end."""
        if self.client is None:
            return (watch_job(lake, job, watch) for job in jobs)
        return _on_dask(self.client, lake, jobs, watch)


@contextmanager
def open_pool(settings: PoolSettings) -> Iterator[Pool]:
    """Workers, which end with this; those of a scheduler stay.

    Raises:
        SettingsError: The scheduler cannot be reached.
        ExtraMissingError: Dask is not installed.
    """
    if not (settings.processes or settings.scheduler):
        yield Pool()
        return
    distributed = imported("distributed")
    if settings.scheduler:
        with _connected(distributed, settings.scheduler) as client:
            yield Pool(client, client.dashboard_link)
        return
    memory = "auto" if settings.memory_gb is None else int(settings.memory_gb * 1e9)
    has_dashboard = find_spec("bokeh") is not None
    with (
        _quiet(),
        _loaded_once(distributed),
        distributed.LocalCluster(
            n_workers=settings.processes,
            threads_per_worker=1,
            processes=True,
            host="127.0.0.1",
            memory_limit=memory,
            dashboard_address="127.0.0.1:0",  # any free port: several may fill lakes here
            silence_logs=logging.CRITICAL,
        ) as cluster,
        distributed.Client(cluster) as client,
    ):
        yield Pool(client, cluster.dashboard_link if has_dashboard else None)


@contextmanager
def _loaded_once(distributed: Any) -> Iterator[None]:
    """Workers are forked from a process that has loaded all that they need, and done nothing else.

    So a worker in place of one that died is there at once, and what is loaded stands in memory once.
    """
    if "forkserver" not in multiprocessing.get_all_start_methods():
        yield
        return
    with imported("dask").config.set({"distributed.worker.multiprocessing-method": "forkserver"}):
        server = distributed.utils.get_mp_context()
        server.set_forkserver_preload(["distributed", watch_job.__module__, "visup.runs.wiring"])
        yield


@contextmanager
def _quiet() -> Iterator[None]:
    """Workers that die are told of in visup's words, and not in Dask's."""
    logger = logging.getLogger("distributed")
    before = logger.level
    logger.setLevel(logging.CRITICAL)
    try:
        yield
    finally:
        logger.setLevel(before)


def _connected(distributed: Any, address: str) -> Any:
    try:
        return distributed.Client(address, timeout=CONNECT_S)
    except (OSError, ValueError, TimeoutError) as fault:
        raise SettingsError(
            f"the scheduler cannot be reached ({type(fault).__name__})",
            where=address,
            expected="the address of a Dask scheduler, such as tcp://head:8786",
        ) from fault


def _on_dask(client: Any, lake: Lake, jobs: Sequence[Job], watch: Watch) -> Iterator[ClipOutcome]:
    distributed = imported("distributed")
    waiting, running = list(reversed(jobs)), dict[Any, tuple[Job, int]]()
    completed = distributed.as_completed(raise_errors=False)

    def submit(job: Job, again: int = 0) -> None:
        key = f"visup-{job.run}-{again}"
        future = client.submit(
            watch_job, Lake(lake.path.absolute()), job, watch, key=key, pure=False
        )
        running[future] = job, again
        completed.add(future)

    workers = len(client.ncores())
    for _ in range(min(len(waiting), max(1, workers) * WAITING_PER_WORKER)):
        submit(waiting.pop())
    for future in completed:
        job, again = running.pop(future)
        outcome = _outcome(lake, job, future, again)
        if outcome is None:
            submit(job, again + 1)
            continue
        if waiting:
            submit(waiting.pop())
        yield outcome


def _outcome(lake: Lake, job: Job, future: Any, again: int) -> ClipOutcome | None:
    """What became of a job; None when it is to be handed over once more."""
    source = job.settings.source
    if future.status == "finished":
        found: ClipOutcome = future.result()
        return found
    if Attempts(lake.path, job.run).exhausted:
        return ClipOutcome(job.run, source, failure=put_aside(job))
    if future.status != "error":
        raise SettingsError(
            "the scheduler was lost",
            hint="run the same command again: what is in the lake is kept, and the rest is done",
        )
    if again >= MOST_RESUBMISSIONS:
        reason = f"its workers were lost {again} times ({error_line(future.exception())})"
        return ClipOutcome(job.run, source, failure=FailedClip(source, reason))
    return None

"""Dask workers on this machine: forked from a preloaded process, and replaced when they die.

Dask itself replaces a worker that dies, but gives up for good if the new one cannot be started or takes too
long, for example because the process from which workers are forked died at the same moment. Such workers are
replaced here.
"""

from __future__ import annotations

import logging
import multiprocessing
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from threading import Event, Thread
from typing import Any

from visup.archive.extra import imported
from visup.archive.filling.piece_queue import watch_piece
from visup.archive.filling.pool_settings import PoolSettings

MAX_RENEWALS = 6
"""Attempts to replace lost workers until all are back; the wait doubles after each failure, to a minute in
all."""
START_S = 300.0
"""How long a replacement may take to start, seconds; a busy machine needs minutes."""
POLL_S = 1.0


@dataclass(slots=True)
class LocalWorkers:
    """Workers started by this process.

    Attributes:
        cluster: The Dask cluster.
        count: Number of workers.
        renewals: Replacements since all workers were last alive.
    """

    cluster: Any
    count: int
    renewals: int = field(default=0, init=False)
    _retry_at: float = field(default=0.0, init=False)

    @contextmanager
    def supervised(self, client: Any, starve: Callable[[], None]) -> Iterator[None]:
        """Replace lost workers while the context is open.

        Args:
            client: Client of the cluster.
            starve: Called once when all workers are gone and cannot be replaced.
        """
        over = Event()

        def watch() -> None:
            last_alive = time.monotonic()
            # A scheduler that is gone is reported where its results are awaited.
            with suppress(OSError, RuntimeError):
                while not over.wait(POLL_S):
                    if alive := len(client.ncores()):
                        last_alive = time.monotonic()
                    self._replace_lost(alive)
                    if time.monotonic() - last_alive > START_S or self._renewals_exhausted(alive):
                        starve()
                        return

        watcher = Thread(target=watch, name="workers", daemon=True)
        watcher.start()
        try:
            yield
        finally:
            over.set()
            watcher.join()

    def _replace_lost(self, alive: int) -> None:
        """Replace the workers that Dask has given up; `alive` are working."""
        if alive >= self.count:
            self.renewals = 0
        lost, now = self._lost(), time.monotonic()
        if not lost or self.renewals >= MAX_RENEWALS or now < self._retry_at:
            return
        self._retry_at = now + 2.0**self.renewals
        self.renewals += 1
        self.cluster.sync(self.cluster.scale_down, lost)
        self.cluster.scale(self.count)

    def _renewals_exhausted(self, alive: int) -> bool:
        return not alive and self.renewals >= MAX_RENEWALS and len(self._lost()) >= self.count

    def _lost(self) -> list[Any]:
        """Names of the workers that Dask has given up."""
        return [
            name
            for name, nanny in list(self.cluster.workers.items())
            if nanny.status.name in ("closed", "failed")
        ]


@contextmanager
def local_workers(settings: PoolSettings) -> Iterator[LocalWorkers]:
    """Workers on this machine, ended with the context.

    Raises:
        ExtraMissingError: Dask is not installed.
    """
    distributed = imported("distributed")
    memory = "auto" if settings.memory_gb is None else int(settings.memory_gb * 1e9)
    with (
        _quiet(),
        _preloaded_forkserver(distributed),
        distributed.LocalCluster(
            n_workers=settings.processes,
            threads_per_worker=1,
            processes=True,
            host="127.0.0.1",
            memory_limit=memory,
            dashboard_address="127.0.0.1:0",  # any free port: several may fill lakes here
            silence_logs=logging.CRITICAL,
        ) as cluster,
    ):
        yield LocalWorkers(cluster, settings.processes)


@contextmanager
def _preloaded_forkserver(distributed: Any) -> Iterator[None]:
    """Fork workers from a process that has only loaded their modules.

    A replacement is ready at once, and the modules are in memory once.
    """
    changed: dict[str, Any] = {
        "distributed.deploy.lost-worker-timeout": f"{START_S} s",
        # Both sample the working thread, up to 1,000 times a second, for figures that nothing reads here.
        "distributed.worker.profile.enabled": False,
        "distributed.admin.system-monitor.gil.enabled": False,
    }
    if "forkserver" in multiprocessing.get_all_start_methods():
        changed["distributed.worker.multiprocessing-method"] = "forkserver"
    with imported("dask").config.set(changed):
        server = distributed.utils.get_mp_context()
        server.set_forkserver_preload(["distributed", watch_piece.__module__, "visup.runs.wiring"])
        yield


@contextmanager
def _quiet() -> Iterator[None]:
    """Silence Dask's messages about dying workers; visup reports them itself."""
    logger = logging.getLogger("distributed")
    before = logger.level
    logger.setLevel(logging.CRITICAL)
    try:
        yield
    finally:
        logger.setLevel(before)

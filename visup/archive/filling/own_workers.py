"""Workers of Dask on this machine: forked from a process that has loaded all, and kept at their number.

Dask puts a worker in the place of one that dies. It gives a place up for good when the new one cannot be
started, as when the process that workers are forked from dies at the same moment, or takes too long; such
places are filled anew here.
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
from visup.archive.filling.pieces import watch_piece
from visup.archive.filling.pool_settings import PoolSettings

MOST_RENEWALS = 6
"""How often workers are started in place of lost ones, before all of them have been there again; after each
failure it waits twice as long, a minute in all."""
START_S = 300.0
"""How long a worker may take to start in place of another one; a busy machine needs minutes for it."""
LOOK_S = 1.0


@dataclass(slots=True)
class OwnWorkers:
    """Workers that were started for this.

    Attributes:
        cluster: Of Dask.
        count: How many there should be.
        renewals: How often lost ones were replaced since all of them were last there.
    """

    cluster: Any
    count: int
    renewals: int = field(default=0, init=False)
    _not_before: float = field(default=0.0, init=False)

    @contextmanager
    def kept(self, client: Any, starve: Callable[[], None]) -> Iterator[None]:
        """Meanwhile lost workers are replaced.

        Args:
            client: Of the cluster.
            starve: Called once when all workers are gone and none comes after them.
        """
        over = Event()

        def look() -> None:
            seen = time.monotonic()
            # That the scheduler is gone is told where it is asked.
            with suppress(OSError, RuntimeError):
                while not over.wait(LOOK_S):
                    if there := len(client.ncores()):
                        seen = time.monotonic()
                    self._renew(there)
                    if time.monotonic() - seen > START_S or self._given_up(there):
                        starve()
                        return

        watcher = Thread(target=look, name="workers", daemon=True)
        watcher.start()
        try:
            yield
        finally:
            over.set()
            watcher.join()

    def _renew(self, there: int) -> None:
        """Start workers in the places that Dask has given up; `there` are at work."""
        if there >= self.count:
            self.renewals = 0
        lost, now = self._lost(), time.monotonic()
        if not lost or self.renewals >= MOST_RENEWALS or now < self._not_before:
            return
        self._not_before = now + 2.0**self.renewals
        self.renewals += 1
        self.cluster.sync(self.cluster.scale_down, lost)
        self.cluster.scale(self.count)

    def _given_up(self, there: int) -> bool:
        return not there and self.renewals >= MOST_RENEWALS and len(self._lost()) >= self.count

    def _lost(self) -> list[Any]:
        """Names of the places that Dask has given up."""
        return [
            name
            for name, nanny in list(self.cluster.workers.items())
            if nanny.status.name in ("closed", "failed")
        ]


@contextmanager
def own_workers(settings: PoolSettings) -> Iterator[OwnWorkers]:
    """Workers of this machine, which end with this.

    Raises:
        ExtraMissingError: Dask is not installed.
    """
    distributed = imported("distributed")
    memory = "auto" if settings.memory_gb is None else int(settings.memory_gb * 1e9)
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
    ):
        yield OwnWorkers(cluster, settings.processes)


@contextmanager
def _loaded_once(distributed: Any) -> Iterator[None]:
    """Workers are forked from a process that has loaded all that they need, and done nothing else.

    So a worker in place of one that died is there at once, and what is loaded stands in memory once.
    """
    changed: dict[str, Any] = {"distributed.deploy.lost-worker-timeout": f"{START_S} s"}
    if "forkserver" in multiprocessing.get_all_start_methods():
        changed["distributed.worker.multiprocessing-method"] = "forkserver"
    with imported("dask").config.set(changed):
        server = distributed.utils.get_mp_context()
        server.set_forkserver_preload(["distributed", watch_piece.__module__, "visup.runs.wiring"])
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

"""Jobs on workers: in this process, or on those of Dask, here or on a cluster.

Dask runs a job again elsewhere when its worker dies; the marks of `attempts.py` see to it that a clip which
ends its workers is given up after two, whatever the scheduler allows. Only a few jobs for each worker are
handed over at a time, so that a scheduler never holds a hundred thousand of them.
"""

from __future__ import annotations

import logging
import multiprocessing
import time
from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from importlib.util import find_spec
from threading import Event, Thread
from typing import Any

from visup.agent.execution.runners import error_line
from visup.agent.model.errors import SettingsError
from visup.archive.extra import imported
from visup.archive.filling.attempts import Attempts
from visup.archive.filling.pieces import ClipPiece, PieceBook, given_up, watch_piece
from visup.archive.filling.plan import FailedClip, Job
from visup.archive.filling.pool_settings import PoolSettings
from visup.archive.filling.watching import ClipOutcome, Watch, watch_into
from visup.archive.lake import Lake

WAITING_PER_WORKER = 3
"""Jobs handed over for each worker: while one is watched, the next is there."""
CONNECT_S = 20
MOST_RESUBMISSIONS = 5
STARVED_S = 60.0
"""How long workers of this machine may all be away, before one no longer waits for them."""
LOOK_S = 2.0


@dataclass(frozen=True, slots=True)
class Pool:
    """Workers that are there.

    Attributes:
        client: Of Dask, or None for this process.
        dashboard: Address of Dask's dashboard, or None.
        own: Whether the workers were started for this, so that none are to be waited for once all are gone.
    """

    client: Any = None
    dashboard: str | None = None
    own: bool = False

    def outcomes(
        self, lake: Lake, jobs: Sequence[Job], watch: Watch = watch_into
    ) -> Iterator[ClipOutcome]:
        """Run jobs and give what becomes of each, in the order in which they end."""
        if self.client is None:
            return _here(lake, jobs, watch)
        return _on_dask(self, lake, jobs, watch)


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
        yield Pool(client, cluster.dashboard_link if has_dashboard else None, own=True)


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


def _connected(distributed: Any, address: str) -> Any:
    try:
        return distributed.Client(address, timeout=CONNECT_S)
    except (OSError, ValueError, TimeoutError) as fault:
        raise SettingsError(
            f"the scheduler cannot be reached ({type(fault).__name__})",
            where=address,
            expected="the address of a Dask scheduler, such as tcp://head:8786",
        ) from fault


def _here(lake: Lake, jobs: Sequence[Job], watch: Watch) -> Iterator[ClipOutcome]:
    book = PieceBook(jobs)
    while piece := book.next():
        if outcome := book.done(piece, watch_piece(lake, piece, watch)):
            yield outcome


@contextmanager
def _lost_when_starved(pool: Pool, running: Collection[Any]) -> Iterator[None]:
    """Meanwhile jobs are taken back when all workers of this machine are gone, and none comes after them.

    Dask replaces a worker that dies, unless the process dies that workers are forked from.
    """
    over = Event()

    def look() -> None:
        seen = time.monotonic()
        # That the scheduler is gone is told where it is asked.
        with suppress(OSError, RuntimeError):
            while not over.wait(LOOK_S):
                if pool.client.ncores():
                    seen = time.monotonic()
                elif time.monotonic() - seen > STARVED_S:
                    pool.client.cancel(list(running), force=True)
                    return

    watcher = Thread(target=look, name="workers", daemon=True)
    if pool.own:
        watcher.start()
    try:
        yield
    finally:
        over.set()
        if pool.own:
            watcher.join(CONNECT_S)


def _on_dask(pool: Pool, lake: Lake, jobs: Sequence[Job], watch: Watch) -> Iterator[ClipOutcome]:
    distributed, client = imported("distributed"), pool.client
    book, running = PieceBook(jobs), dict[Any, tuple[ClipPiece, int]]()
    completed = distributed.as_completed(raise_errors=False)

    def submit(piece: ClipPiece | None, again: int = 0) -> None:
        if piece is None:
            return
        future = client.submit(
            watch_piece,
            Lake(lake.path.absolute()),
            piece,
            watch,
            key=f"visup-{piece.key}-{again}",
            pure=False,
        )
        running[future] = piece, again
        completed.add(future)

    for _ in range(max(1, len(client.ncores())) * WAITING_PER_WORKER):
        submit(book.next())
    with _lost_when_starved(pool, running):
        for future in completed:
            piece, again = running.pop(future)
            outcome = _outcome(lake, piece, future, again)
            if outcome is None:
                submit(piece, again + 1)
                continue
            finished = book.done(piece, outcome)
            submit(book.next())
            if finished:
                yield finished


def _outcome(lake: Lake, piece: ClipPiece, future: Any, again: int) -> ClipOutcome | None:
    """What became of a piece; None when it is to be handed over once more."""
    run, source = piece.job.run, piece.job.settings.source
    if future.status == "finished":
        found: ClipOutcome = future.result()
        return found
    if Attempts(lake.path, piece.key).exhausted:
        return given_up(lake, piece)
    if future.status != "error":
        raise SettingsError(
            "the scheduler was lost, or all workers",
            hint="run the same command again: what is in the lake is kept, and the rest is done",
        )
    if again >= MOST_RESUBMISSIONS:
        reason = f"its workers were lost {again} times ({error_line(future.exception())})"
        return ClipOutcome(run, source, failure=FailedClip(source, reason))
    return None

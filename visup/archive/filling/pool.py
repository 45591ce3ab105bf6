"""Runs jobs in this process, or on Dask workers here or on a cluster.

Dask reruns a job elsewhere when its worker dies; the marks of `attempts.py` ensure that a clip which crashes
its workers is given up after two, whatever the scheduler allows. Only a few jobs per worker are submitted at
a time, so that a scheduler never holds a hundred thousand of them.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import dataclass
from importlib.util import find_spec
from typing import Any

import cv2

from visup.agent.execution.runners import error_line
from visup.agent.model.errors import SettingsError
from visup.archive.extra import imported
from visup.archive.filling.attempts import Attempts
from visup.archive.filling.local_workers import LocalWorkers, local_workers
from visup.archive.filling.piece_queue import ClipPiece, PieceQueue, crashed_outcome, watch_piece
from visup.archive.filling.plan import FailedClip, Job
from visup.archive.filling.pool_settings import PoolSettings
from visup.archive.filling.watching import ClipOutcome, Watch, watch_into
from visup.archive.lake import Lake

QUEUED_PER_WORKER = 3
"""Jobs submitted per worker, so that the next is ready when one ends."""
CONNECT_S = 20
MAX_RESUBMISSIONS = 5


@dataclass(frozen=True, slots=True)
class Pool:
    """Available workers.

    Attributes:
        client: Dask client, or None for this process.
        dashboard: Address of Dask's dashboard, or None.
        own: The workers, if this process started them.
    """

    client: Any = None
    dashboard: str | None = None
    own: LocalWorkers | None = None

    def outcomes(
        self, lake: Lake, jobs: Sequence[Job], watch: Watch = watch_into
    ) -> Iterator[ClipOutcome]:
        """Run jobs and yield the outcome of each in the order of completion."""
        if self.client is None:
            return _in_process(lake, jobs, watch)
        return _on_dask(self, lake, jobs, watch)


@contextmanager
def open_pool(settings: PoolSettings) -> Iterator[Pool]:
    """Open a pool; workers started here end with the context, those of a scheduler stay.

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
    has_dashboard = find_spec("bokeh") is not None
    with local_workers(settings) as own, distributed.Client(own.cluster) as client:
        yield Pool(client, own.cluster.dashboard_link if has_dashboard else None, own)


def _connected(distributed: Any, address: str) -> Any:
    try:
        return distributed.Client(address, timeout=CONNECT_S)
    except (OSError, ValueError, TimeoutError) as fault:
        raise SettingsError(
            f"the scheduler cannot be reached ({type(fault).__name__})",
            where=address,
            expected="the address of a Dask scheduler, such as tcp://head:8786",
        ) from fault


def _in_process(lake: Lake, jobs: Sequence[Job], watch: Watch) -> Iterator[ClipOutcome]:
    book = PieceQueue(jobs)
    while piece := book.next():
        if outcome := book.done(piece, watch_piece(lake, piece, watch)):
            yield outcome


def _on_worker(lake: Lake, piece: ClipPiece, watch: Watch) -> ClipOutcome:
    """Do a piece on one core, since every core has a worker."""
    cv2.setNumThreads(1)
    return watch_piece(lake, piece, watch)


def _on_dask(pool: Pool, lake: Lake, jobs: Sequence[Job], watch: Watch) -> Iterator[ClipOutcome]:
    distributed, client = imported("distributed"), pool.client
    # The longest first, so that no worker is left with a long clip at the end (LPT scheduling).
    book = PieceQueue(sorted(jobs, key=lambda job: job.bytes, reverse=True))
    running: dict[Any, tuple[ClipPiece, int]] = {}
    completed = distributed.as_completed(raise_errors=False)

    def submit(piece: ClipPiece | None, resubmissions: int = 0) -> None:
        if piece is None:
            return
        future = client.submit(
            _on_worker,
            Lake(lake.path.absolute()),
            piece,
            watch,
            key=f"visup-{piece.key}-{resubmissions}",
            pure=False,
        )
        running[future] = piece, resubmissions
        completed.add(future)

    for _ in range(max(1, len(client.ncores())) * QUEUED_PER_WORKER):
        submit(book.next())

    def resubmit() -> None:
        client.cancel(list(running), force=True)

    with pool.own.supervised(client, resubmit) if pool.own else nullcontext():
        for future in completed:
            piece, resubmissions = running[future]
            outcome = _outcome(lake, piece, future, resubmissions)
            del running[future]
            if outcome is None:
                submit(piece, resubmissions + 1)
                continue
            finished = book.done(piece, outcome)
            submit(book.next())
            if finished:
                yield finished


def _outcome(lake: Lake, piece: ClipPiece, future: Any, resubmissions: int) -> ClipOutcome | None:
    """The outcome of a piece; None if it must be submitted again."""
    run, source = piece.job.run, piece.job.settings.source
    if future.status == "finished":
        with suppress(Exception):  # fails if the worker died with the result
            found: ClipOutcome = future.result()
            return found
    if Attempts(lake.path, piece.key).exhausted:
        return crashed_outcome(lake, piece)
    if future.status == "cancelled":
        raise SettingsError(
            "all workers were lost, or the scheduler",
            hint="run the same command again: what is in the lake is kept, and the rest is done",
        )
    if resubmissions >= MAX_RESUBMISSIONS:
        why = f" ({error_line(future.exception())})" if future.status == "error" else ""
        reason = f"its workers were lost {resubmissions} times{why}"
        return ClipOutcome(run, source, failure=FailedClip(source, reason))
    return None

"""Jobs on workers: in this process, or on those of Dask, here or on a cluster.

Dask runs a job again elsewhere when its worker dies; the marks of `attempts.py` see to it that a clip which
ends its workers is given up after two, whatever the scheduler allows. Only a few jobs for each worker are
handed over at a time, so that a scheduler never holds a hundred thousand of them.
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
from visup.archive.filling.own_workers import OwnWorkers, own_workers
from visup.archive.filling.pieces import ClipPiece, PieceBook, given_up, watch_piece
from visup.archive.filling.plan import FailedClip, Job
from visup.archive.filling.pool_settings import PoolSettings
from visup.archive.filling.watching import ClipOutcome, Watch, watch_into
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
        own: Its workers, when they were started for this.
    """

    client: Any = None
    dashboard: str | None = None
    own: OwnWorkers | None = None

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
    has_dashboard = find_spec("bokeh") is not None
    with own_workers(settings) as own, distributed.Client(own.cluster) as client:
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


def _here(lake: Lake, jobs: Sequence[Job], watch: Watch) -> Iterator[ClipOutcome]:
    book = PieceBook(jobs)
    while piece := book.next():
        if outcome := book.done(piece, watch_piece(lake, piece, watch)):
            yield outcome


def _on_worker(lake: Lake, piece: ClipPiece, watch: Watch) -> ClipOutcome:
    """Do a piece on one core: the others have workers of their own, and threads would be in their way."""
    cv2.setNumThreads(1)
    return watch_piece(lake, piece, watch)


def _on_dask(pool: Pool, lake: Lake, jobs: Sequence[Job], watch: Watch) -> Iterator[ClipOutcome]:
    distributed, client = imported("distributed"), pool.client
    book, running = PieceBook(jobs), dict[Any, tuple[ClipPiece, int]]()
    completed = distributed.as_completed(raise_errors=False)

    def submit(piece: ClipPiece | None, again: int = 0) -> None:
        if piece is None:
            return
        future = client.submit(
            _on_worker,
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

    def take_back() -> None:
        client.cancel(list(running), force=True)

    with pool.own.kept(client, take_back) if pool.own else nullcontext():
        for future in completed:
            piece, again = running[future]
            outcome = _outcome(lake, piece, future, again)
            del running[future]
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
        with suppress(Exception):  # its worker has died since, with the result
            found: ClipOutcome = future.result()
            return found
    if Attempts(lake.path, piece.key).exhausted:
        return given_up(lake, piece)
    if future.status == "cancelled":
        raise SettingsError(
            "all workers were lost, or the scheduler",
            hint="run the same command again: what is in the lake is kept, and the rest is done",
        )
    if again >= MOST_RESUBMISSIONS:
        why = f" ({error_line(future.exception())})" if future.status == "error" else ""
        reason = f"its workers were lost {again} times{why}"
        return ClipOutcome(run, source, failure=FailedClip(source, reason))
    return None

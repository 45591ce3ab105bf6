"""Units of work: a clip, a chunk of a long one, or the stitching of its chunks.

Recorded chunks stay in the lake until their run is committed, so that a restart continues with the missing
ones.
"""

from __future__ import annotations

import os
import shutil
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from visup.agent.storage.journal_reader import JOURNAL
from visup.archive.chunks.stitching import stitch_into
from visup.archive.filling.attempts import Attempts
from visup.archive.filling.plan import FailedClip, Job, put_aside
from visup.archive.filling.watching import WORK, ClipOutcome, Watch, reason_of, watch_job
from visup.archive.lake import Lake

CHUNKS = "chunks"
"""Folder of a lake for recorded chunks until all chunks of their clip are ready."""


@dataclass(frozen=True, slots=True)
class ClipPiece:
    """One unit of work.

    Attributes:
        job: The clip.
        chunk: Number of the chunk; None for the whole clip or its stitching.
    """

    job: Job
    chunk: int | None = None

    @property
    def key(self) -> str:
        """Unique key."""
        return self.job.run if self.chunk is None else f"{self.job.run}-{self.chunk}"

    def folder(self, lake: Path) -> Path:
        """Folder of the chunk, or of all chunks of the clip."""
        folder = lake / CHUNKS / self.job.run
        return folder if self.chunk is None else folder / f"{self.chunk:04}"


class PieceQueue:
    """The queue of pieces, and the progress of their clips.

    Args:
        jobs: Clips in order.
    """

    def __init__(self, jobs: Sequence[Job]) -> None:
        self._waiting = [p for job in reversed(jobs) for p in reversed(_first_pieces(job))]
        self._chunks_left = {job.run: len(job.spans) for job in jobs}
        self._work_s: dict[str, float] = {job.run: 0.0 for job in jobs}

    def next(self) -> ClipPiece | None:
        """The next piece; None if none is waiting."""
        return self._waiting.pop() if self._waiting else None

    def done(self, piece: ClipPiece, outcome: ClipOutcome) -> ClipOutcome | None:
        """Record a finished piece; returns the outcome of its clip once it is known."""
        run = piece.job.run
        if run not in self._chunks_left:  # another chunk has failed
            return None
        self._work_s[run] += outcome.wall_s
        if outcome.failure or piece.chunk is None:
            del self._chunks_left[run]
            self._waiting = [p for p in self._waiting if p.job.run != run]
            return replace(outcome, wall_s=self._work_s[run])
        self._chunks_left[run] -= 1
        if not self._chunks_left[run]:
            self._waiting.append(ClipPiece(piece.job))
        return None


def watch_piece(lake: Lake, piece: ClipPiece, watch: Watch) -> ClipOutcome:
    """Do a piece; faults of the clip are part of the outcome and not raised.

    Args:
        lake: The lake.
        piece: The piece.
        watch: Records a clip or chunk.
    """
    if piece.chunk is not None:
        return _watch_chunk(lake, piece, piece.chunk, watch)
    if not piece.job.spans:
        return watch_job(lake, piece.job, watch)
    chunks = (ClipPiece(piece.job, n) for n in range(len(piece.job.spans)))
    journals = [chunk.folder(lake.path) / JOURNAL for chunk in chunks]
    outcome = watch_job(lake, piece.job, partial(stitch_into, journals=journals))
    if not outcome.failure:
        shutil.rmtree(piece.folder(lake.path), ignore_errors=True)
    return outcome


def crashed_outcome(lake: Lake, piece: ClipPiece) -> ClipOutcome:
    """The outcome of a clip whose piece crashed its workers."""
    Attempts(lake.path, piece.job.run).exhaust()
    return ClipOutcome(piece.job.run, piece.job.settings.source, failure=put_aside(piece.job))


def _first_pieces(job: Job) -> list[ClipPiece]:
    """The pieces of a clip that can be done first."""
    return [ClipPiece(job, n) for n in range(len(job.spans))] or [ClipPiece(job)]


def _watch_chunk(lake: Lake, piece: ClipPiece, chunk: int, watch: Watch) -> ClipOutcome:
    start, job = time.monotonic(), piece.job
    source, target = job.settings.source, piece.folder(lake.path)
    if target.exists():  # recorded before a restart
        return ClipOutcome(job.run, source)
    attempts = Attempts(lake.path, piece.key)
    folder = lake.path / WORK / f"{piece.key}-{os.getpid()}"
    try:
        if not attempts.begin():
            return crashed_outcome(lake, piece)
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        watch(job.settings, folder, job.spans[chunk].frames)
        target.parent.mkdir(parents=True, exist_ok=True)
        folder.rename(target)
    except Exception as fault:
        attempts.clear()
        return ClipOutcome(job.run, source, failure=FailedClip(source, reason_of(fault, source)))
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    attempts.clear()
    return ClipOutcome(job.run, source, wall_s=time.monotonic() - start)

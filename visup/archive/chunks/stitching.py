"""What the chunks of a video perceived as one run.

A mind reasons about all of it from beginning to end, so that identities, stages and alerts go over a seam as
over any other frame; only what behaviours remember begins anew in each chunk.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from visup.agent import Observation
from visup.agent.storage.journal import Journal
from visup.agent.storage.journal_reader import JOURNAL, Recording
from visup.archive.chunks.extending import extend_chunk
from visup.archive.chunks.region_matching import RegionNumbers
from visup.archive.chunks.seams import Part, find_parts
from visup.runs.replay import replay
from visup.runs.resume import recorded_settings
from visup.runs.settings import WatchSettings


@dataclass(frozen=True, slots=True)
class ChunkedRecording(Recording):
    """The recordings of chunks, read as one.

    Attributes:
        path: Journal of the first chunk.
        parts: What is taken of which chunk, in their order.
    """

    parts: tuple[Part, ...] = ()

    def observations(self, after: int = -1) -> Iterator[Observation]:
        """What was perceived, frame by frame, each once; see `Recording.observations`."""
        return (o for o in stitched(self.parts) if o.frame_index > after)


def stitched(parts: Sequence[Part]) -> Iterator[Observation]:
    """Each frame once, its regions under ids that go over all chunks.

    Args:
        parts: What is taken of which chunk.
    """
    numbers = RegionNumbers()
    for part, following in zip(parts, [*parts[1:], None], strict=True):
        numbers.known = {
            new: numbers.known[old] for new, old in part.same.items() if old in numbers.known
        }
        for seen in part.chunk.observations(part.first - 1):
            if following and seen.frame_index >= following.first:
                break
            yield numbers.renumbered(seen)


def stitch_into(settings: WatchSettings, folder: Path, journals: Sequence[Path]) -> None:
    """Reason about chunks from beginning to end, and record the run in a folder.

    Args:
        settings: Those of the run; the chunks tell which models their actors stand for.
        folder: A folder that is there.
        journals: Of the chunks, in their order; where two do not see alike at the end of the one, it is
            watched on.

    Raises:
        VisupError: A chunk is damaged, or the run cannot be recorded.
    """
    chunks = [Recording.open(path) for path in journals]

    def extend(chunk: Recording, end: int) -> None:
        extend_chunk(settings, chunk, end)

    parts = find_parts(chunks, extend)
    first, last = chunks[0].facts(), chunks[-1].facts()
    bound = recorded_settings(first, str(journals[0])).actors
    whole = ChunkedRecording(journals[0], parts)
    replay(whole, replace(settings, actors=bound), folder)
    journal = Journal(folder / JOURNAL, resume=True)
    try:
        looked_at = [chunk.first_and_last() for chunk in chunks]
        seams = [part.first for part in parts[1:]]
        journal.note(live=False, replayed=None, chunks=looked_at, seams=seams)
        journal.note(**{key: last.get(key) for key in ("problem", "ended")})
    finally:
        journal.close()

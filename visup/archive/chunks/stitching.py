"""Stitches the chunks of a video to one run.

Reasoning runs over all observations from beginning to end, so that identities, stages and alerts continue
across a seam; only the memory of behaviours starts anew in each chunk.
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
    """The recordings of chunks as one recording.

    Attributes:
        path: Journal of the first chunk.
        parts: The parts of the chunks in order.
    """

    parts: tuple[Part, ...] = ()

    def observations(self, after: int = -1) -> Iterator[Observation]:
        """Each frame's observation once; see `Recording.observations`."""
        return (o for o in stitched(self.parts) if o.frame_index > after)


def stitched(parts: Sequence[Part]) -> Iterator[Observation]:
    """Each frame's observation once, with region ids that are consistent over all chunks.

    Args:
        parts: The parts of the chunks in order.
    """
    numbers = RegionNumbers()
    for part, following in zip(parts, [*parts[1:], None], strict=True):
        numbers.known = {
            new: numbers.known[old] for new, old in part.same.items() if old in numbers.known
        }
        for observation in part.chunk.observations(part.first - 1):
            if following and observation.frame_index >= following.first:
                break
            yield numbers.renumbered(observation)


def stitch_into(settings: WatchSettings, folder: Path, journals: Sequence[Path]) -> None:
    """Reason about chunks from beginning to end, and record the run in a folder.

    Args:
        settings: Settings of the run; the bindings of actors come from the chunks.
        folder: An existing folder.
        journals: Journals of the chunks in order; a chunk that does not agree with the next at its end is
            continued.

    Raises:
        VisupError: A chunk is damaged, or the run cannot be recorded.
    """
    chunks = [Recording.open(path) for path in journals]

    def extend(chunk: Recording, end: int) -> None:
        extend_chunk(settings, chunk, end)

    parts = find_parts(chunks, extend)
    first, last = chunks[0].facts(), chunks[-1].facts()
    bound = recorded_settings(first, str(journals[0])).actors
    recording = ChunkedRecording(journals[0], parts)
    replay(recording, replace(settings, actors=bound), folder)
    journal = Journal(folder / JOURNAL, resume=True)
    try:
        frame_spans = [chunk.first_and_last() for chunk in chunks]
        seams = [part.first for part in parts[1:]]
        journal.note(live=False, replayed=None, chunks=frame_spans, seams=seams)
        journal.note(**{key: last.get(key) for key in ("problem", "ended")})
    finally:
        journal.close()

"""What the chunks of a video perceived as one run: who is who is told by the frames that two have seen.

A mind then reasons about all of it from beginning to end, so that identities, stages and alerts go over a
seam as over any other frame; only what behaviours remember begins anew in each chunk.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from pathlib import Path

from visup.agent import Observation
from visup.agent.storage.journal import Journal
from visup.agent.storage.journal_reader import JOURNAL, Recording
from visup.archive.chunks.region_matching import RegionMatcher, RegionNumbers
from visup.rules.geometry.regions import shared_pixels
from visup.runs.replay import replay
from visup.runs.resume import recorded_settings
from visup.runs.settings import WatchSettings


@dataclass(frozen=True, slots=True)
class ChunkedRecording(Recording):
    """The recordings of chunks that overlap, read as one.

    Attributes:
        path: Journal of the first chunk.
        later: Journals of the others, in their order.
    """

    later: tuple[Path, ...] = ()

    def observations(self, after: int = -1) -> Iterator[Observation]:
        """What was perceived, frame by frame, each once; see `Recording.observations`."""
        chunks = [Recording(path).observations() for path in (self.path, *self.later)]
        return (o for o in stitched(chunks) if o.frame_index > after)


def stitched(chunks: Sequence[Iterator[Observation]]) -> Iterator[Observation]:
    """Each frame once, its regions under ids that go over all chunks.

    Args:
        chunks: What each perceived, in the order of their beginnings; one goes on where the next has begun
            already.
    """
    numbers, stream = RegionNumbers(), chunks[0]
    for later in chunks[1:]:
        first = next(later, None)
        if first is None:  # the video was shorter than it announced
            continue
        held = list[Observation]()
        for seen in map(numbers.renumbered, stream):
            if seen.frame_index < first.frame_index:
                yield seen
            else:
                held.append(seen)
        last = held[-1].frame_index if held else first.frame_index
        fresh = [first]
        while fresh[-1].frame_index < last and (more := next(later, None)):
            fresh.append(more)
        pairs = _same_frames(held, fresh)
        numbers.known = same_regions(pairs)
        seam = seam_frame(pairs, numbers.known) if pairs else first.frame_index
        yield from (o for o in held if o.frame_index < seam)
        stream = chain((o for o in fresh if o.frame_index >= seam), later)
    yield from map(numbers.renumbered, stream)


FramePairs = Sequence[tuple[Observation, Observation]]
"""Frames that both chunks have seen: as the one saw it that ends, and as the one that begins."""


def same_regions(pairs: FramePairs) -> dict[int, int]:
    """Ids of the chunk that begins -> those of the one that ends, of regions that are the same."""
    matcher = RegionMatcher()
    for old, new in pairs:
        matcher.add(old.of("region"), new.of("region"))
    return matcher.same()


def seam_frame(pairs: FramePairs, same: Mapping[int, int]) -> int:
    """The first frame that is taken from the chunk that begins: where both see most alike.

    It is in the later half of what both have seen, so that the one that begins has seen something before.
    """
    late = pairs[len(pairs) // 2 :]
    return min(late, key=lambda pair: _difference(pair, same))[0].frame_index


def _difference(
    pair: tuple[Observation, Observation], same: Mapping[int, int]
) -> tuple[int, float]:
    """How many regions only one has seen, and the share of all pixels in which both differ."""
    old, new = pair
    before = {r.id: r for r in old.of("region")}
    after = {same.get(r.id, -r.id): r for r in new.of("region")}
    shared = sum(shared_pixels(before[k], after[k]) for k in before.keys() & after.keys())
    total = sum(r.area for r in (*before.values(), *after.values()))
    return len(before.keys() ^ after.keys()), 1.0 - 2.0 * shared / total if total else 0.0


def _same_frames(held: Sequence[Observation], fresh: Sequence[Observation]) -> FramePairs:
    known = {o.frame_index: o for o in held}
    return [(known[o.frame_index], o) for o in fresh if o.frame_index in known]


def stitch_into(settings: WatchSettings, folder: Path, journals: Sequence[Path]) -> None:
    """Reason about chunks from beginning to end, and record the run in a folder.

    Args:
        settings: Those of the run; the chunks tell which models their actors stand for.
        folder: A folder that is there.
        journals: Of the chunks, in their order.

    Raises:
        VisupError: A chunk is damaged, or the run cannot be recorded.
    """
    chunks = [Recording.open(path) for path in journals]
    whole = ChunkedRecording(journals[0], tuple(journals[1:]))
    first, last = chunks[0].facts(), chunks[-1].facts()
    bound = recorded_settings(first, str(journals[0])).actors
    replay(whole, replace(settings, actors=bound), folder)
    journal = Journal(folder / JOURNAL, resume=True)
    try:
        journal.note(live=False, chunks=len(chunks), replayed=None)
        journal.note(**{key: last.get(key) for key in ("problem", "ended")})
    finally:
        journal.close()

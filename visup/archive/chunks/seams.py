"""Where the recording of one chunk ends and that of the next begins: where both see alike.

A chunk that has seen enough sees what a run from the beginning of the video would see; how much is enough is
told by the chunk before it. Where the two differ still at the end of that one, it is watched on, for a while.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

from visup.agent import Observation
from visup.agent.storage.journal_reader import Recording
from visup.archive.chunks.region_matching import RegionMatcher
from visup.rules.geometry.regions import shared_pixels

ALIKE = 0.01
"""Share of all pixels of regions in which two chunks may differ where they see alike. On the shared missions
chunks that have come to see the same differ by a tenth of that; those that have not, by two to ten times."""
ALIKE_S = 1.0
"""For so long they must."""
STEP_S = 5.0
MOST_S = 30.0
"""A chunk is watched on in such steps, seconds, and no longer: a scene may be so that two never agree."""

Extend = Callable[[Recording, int], None]
"""Watches a chunk on to the frame before a given one."""
FramePairs = Sequence[tuple[Observation, Observation]]
"""Frames that both chunks have seen: as the one saw it that ends, and as the one that begins."""


@dataclass(frozen=True, slots=True)
class Part:
    """What is taken of a chunk.

    Attributes:
        chunk: Its recording.
        first: The first frame that is taken of it.
        same: Ids of its regions -> ids of the same regions in the part before.
    """

    chunk: Recording
    first: int = 0
    same: Mapping[int, int] = field(default_factory=dict)


def find_parts(chunks: Sequence[Recording], extend: Extend) -> tuple[Part, ...]:
    """What is to be taken of which chunk.

    Args:
        chunks: In the order of their beginnings; one goes on where the next has begun already.
        extend: Watches one on.

    Returns:
        Parts in their order; a chunk with which the one before never agreed, until it was watched to the
        end of it, has none.
    """
    parts = [Part(chunks[0])]
    for chunk in chunks[1:]:
        found = _part(parts[-1].chunk, chunk, extend)
        parts += [found] if found else []
    return tuple(parts)


def _part(before: Recording, chunk: Recording, extend: Extend) -> Part | None:
    """What is taken of a chunk, or None when nothing is."""
    ends, ended = chunk.first_and_last(), before.first_and_last()
    if ends is None or ended is None:  # the video was shorter than it announced
        return None
    pairs = _same_frames(before, chunk)
    step, left = max(1, round(STEP_S * _rate(pairs))), int(MOST_S / STEP_S)
    while pairs and not _alike_at_the_end(pairs):
        if pairs[-1][1].frame_index >= ends[1]:
            return None
        if not left:
            break
        left -= 1
        extend(before, pairs[-1][0].frame_index + 1 + step)
        pairs = _same_frames(before, chunk)
    same = same_regions(pairs)
    return Part(chunk, seam_frame(pairs, same) if pairs else ends[0], same)


def same_regions(pairs: FramePairs) -> dict[int, int]:
    """Ids of the chunk that begins -> those of the one that ends, of regions that are the same."""
    matcher = RegionMatcher()
    for old, new in pairs:
        matcher.add(old.of("region"), new.of("region"))
    return matcher.same()


def seam_frame(pairs: FramePairs, same: Mapping[int, int]) -> int:
    """The first frame that is taken from the chunk that begins: the one in which both see most alike.

    It is in the last seconds that both have seen, where they do; else in the later half.
    """
    late = _last_moment(pairs) if _alike_at_the_end(pairs) else pairs[len(pairs) // 2 :]
    return min(late, key=lambda pair: _difference(pair, same))[0].frame_index


def _alike_at_the_end(pairs: FramePairs) -> bool:
    """Whether both see alike in all of the last moment."""
    same = same_regions(pairs)
    return all(_difference(pair, same) <= (0, ALIKE) for pair in _last_moment(pairs))


def _last_moment(pairs: FramePairs) -> FramePairs:
    last = pairs[-1][0].time
    return [pair for pair in pairs if pair[0].time > last - ALIKE_S]


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


def _same_frames(before: Recording, chunk: Recording) -> FramePairs:
    ends, ended = chunk.first_and_last(), before.first_and_last()
    if ends is None or ended is None:
        return []
    old = {o.frame_index: o for o in before.observations(ends[0] - 1)}
    pairs = []
    for new in chunk.observations():
        if new.frame_index > ended[1]:
            break
        if new.frame_index in old:
            pairs.append((old[new.frame_index], new))
    return pairs


def _rate(pairs: FramePairs) -> float:
    """Frames of the source a second, as far as a chunk tells."""
    if len(pairs) < 2:
        return 1.0
    (first, _), (last, _) = pairs[0], pairs[-1]
    return (last.frame_index - first.frame_index) / max(1e-6, last.time - first.time)

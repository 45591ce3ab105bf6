"""Chooses the seam between two chunks: a frame at which their regions agree.

After some frames a chunk sees the same as a run from the beginning of the video would; the chunk before it
shows from where on. If the two still differ at the end of the earlier one, it is continued for a while.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

from visup.agent import Observation
from visup.agent.storage.journal_reader import Recording
from visup.archive.chunks.region_matching import RegionMatcher
from visup.rules.geometry.regions import shared_pixels

ALIKE = 0.01
"""Share of all region pixels by which two chunks that agree may differ. On the shared missions chunks that
have converged differ by a tenth of that; those that have not, by two to ten times as much."""
ALIKE_S = 1.0
"""How long they must agree, seconds."""
STEP_S = 5.0
MAX_S = 30.0
"""A chunk is continued in steps of the one, at most for the other, seconds: in some scenes two never
agree."""

Extend = Callable[[Recording, int], None]
"""Continues a chunk up to the frame before a given one."""
FramePairs = Sequence[tuple[Observation, Observation]]
"""Frames that both chunks processed: (the earlier chunk's observation, the later's)."""


@dataclass(frozen=True, slots=True)
class Part:
    """The part of a chunk that goes into the run.

    Attributes:
        chunk: Its recording.
        first: Its first frame.
        same: Ids of its regions -> ids of the same regions in the previous part.
    """

    chunk: Recording
    first: int = 0
    same: Mapping[int, int] = field(default_factory=dict)


def find_parts(chunks: Sequence[Recording], extend: Extend) -> tuple[Part, ...]:
    """The parts of the chunks that make up the run.

    Args:
        chunks: In order of their beginnings; successive chunks overlap.
        extend: Continues a chunk.

    Returns:
        Parts in order; a chunk with which the one before never agreed up to its end has none.
    """
    parts = [Part(chunks[0])]
    for chunk in chunks[1:]:
        found = _part(parts[-1].chunk, chunk, extend)
        parts += [found] if found else []
    return tuple(parts)


def _part(before: Recording, chunk: Recording, extend: Extend) -> Part | None:
    """The part of a chunk, or None."""
    ends, ended = chunk.first_and_last(), before.first_and_last()
    if ends is None or ended is None:  # the video was shorter than its header says
        return None
    pairs = _same_frames(before, chunk)
    step, attempts_left = max(1, round(STEP_S * _rate(pairs))), int(MAX_S / STEP_S)
    while pairs and not _alike_at_the_end(pairs):
        if pairs[-1][1].frame_index >= ends[1]:
            return None
        if not attempts_left:
            break
        attempts_left -= 1
        extend(before, pairs[-1][0].frame_index + 1 + step)
        pairs = _same_frames(before, chunk)
    same = same_regions(pairs)
    return Part(chunk, seam_frame(pairs, same) if pairs else ends[0], same)


def same_regions(pairs: FramePairs) -> dict[int, int]:
    """Ids of the later chunk -> ids of the earlier one, for regions that are the same."""
    matcher = RegionMatcher()
    for old, new in pairs:
        matcher.add(old.of("region"), new.of("region"))
    return matcher.same()


def seam_frame(pairs: FramePairs, same: Mapping[int, int]) -> int:
    """The first frame taken from the later chunk: the one at which both agree best.

    It is in the last seconds of the overlap if the chunks agree there, else in its later half.
    """
    late = _last_moment(pairs) if _alike_at_the_end(pairs) else pairs[len(pairs) // 2 :]
    return min(late, key=lambda pair: _difference(pair, same))[0].frame_index


def _alike_at_the_end(pairs: FramePairs) -> bool:
    """Whether both agree throughout the last `ALIKE_S`."""
    same = same_regions(pairs)
    return all(_difference(pair, same) <= (0, ALIKE) for pair in _last_moment(pairs))


def _last_moment(pairs: FramePairs) -> FramePairs:
    last = pairs[-1][0].time
    return [pair for pair in pairs if pair[0].time > last - ALIKE_S]


def _difference(
    pair: tuple[Observation, Observation], same: Mapping[int, int]
) -> tuple[int, float]:
    """The number of regions that only one has, and the share of region pixels that differ."""
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
    """Source frames per second, estimated from a chunk."""
    if len(pairs) < 2:
        return 1.0
    (first, _), (last, _) = pairs[0], pairs[-1]
    return (last.frame_index - first.frame_index) / max(1e-6, last.time - first.time)

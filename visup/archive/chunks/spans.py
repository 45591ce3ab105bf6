"""Where a long video is cut: chunks that overlap, so that each has seen something before it counts."""

from __future__ import annotations

from dataclasses import dataclass

from visup.runs.settings import WatchSettings

WARM_UP_S = 5.0
"""How long a chunk looks at what is before its own, and what is after it, seconds."""
SHORTEST_CHUNK_S = 3 * WARM_UP_S
LONGER = 1.5
"""What is shorter than so many chunks is not cut."""


@dataclass(frozen=True, slots=True)
class ChunkSpan:
    """The frames that one chunk looks at, by their numbers in the source.

    Attributes:
        begin: The first.
        end: The one after the last; None for all that are left.
    """

    begin: int
    end: int | None

    @property
    def frames(self) -> tuple[int, int | None]:
        """As `VideoSource.span` has it."""
        return self.begin, self.end


def chunk_spans(frames: int, length: int, warm_up: int) -> tuple[ChunkSpan, ...]:
    """The chunks of a video, all nearly of one length.

    Args:
        frames: How many the video has.
        length: Frames of a chunk, 1 or more, without those that others look at, too.
        warm_up: How many frames a chunk looks at before its own, and after them.

    Returns:
        Chunks in their order, which together look at all frames; one where the video is short.

    >>> chunk_spans(900, 300, 50)[1]
    ChunkSpan(begin=250, end=650)
    """
    count = max(1, round(frames / length)) if frames >= LONGER * length else 1
    edges = [n * frames // count for n in range(count)]
    ends = [*(edge + warm_up for edge in edges[1:]), None]
    return tuple(ChunkSpan(max(0, b - warm_up), e) for b, e in zip(edges, ends, strict=True))


@dataclass(frozen=True, slots=True)
class Cutting:
    """How long videos are cut.

    Attributes:
        chunk_s: Seconds of a chunk.
        warm_up_s: Seconds that it looks at before and after, too.
    """

    chunk_s: float
    warm_up_s: float = WARM_UP_S

    def spans(self, settings: WatchSettings) -> tuple[ChunkSpan, ...]:
        """The chunks of the source of some settings; none where it is short, or nobody knows how long.

        Raises:
            SourceError: It cannot be opened.
        """
        from visup.runs.wiring import open_video  # commands read this file before they need eyes

        with open_video(settings) as source:
            frames, fps = source.frame_count, source.fps
        length, warm_up = (max(1, round(s * fps)) for s in (self.chunk_s, self.warm_up_s))
        found = chunk_spans(frames or 0, length, warm_up)
        return found if len(found) > 1 else ()

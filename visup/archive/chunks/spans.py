"""Cuts a long video into overlapping chunks, so that each has a warm-up before its own part."""

from __future__ import annotations

from dataclasses import dataclass

from visup.runs.settings import WatchSettings

WARM_UP_S = 5.0
"""Overlap of a chunk before and after its own part, seconds."""
SHORTEST_CHUNK_S = 3 * WARM_UP_S
LONGER = 1.5
"""A video shorter than this many chunks is not cut."""


@dataclass(frozen=True, slots=True)
class ChunkSpan:
    """The frames of one chunk, numbered as in the source.

    Attributes:
        begin: The first frame.
        end: The frame after the last; None for the end of the video.
    """

    begin: int
    end: int | None

    @property
    def frames(self) -> tuple[int, int | None]:
        """In the form of `VideoSource.span`."""
        return self.begin, self.end


def chunk_spans(frames: int, length: int, warm_up: int) -> tuple[ChunkSpan, ...]:
    """The chunks of a video, of nearly equal length.

    Args:
        frames: Frames of the video.
        length: Frames of a chunk, 1 or more, without the overlap.
        warm_up: Frames of overlap before and after.

    Returns:
        Chunks in order, which cover all frames; a single one for a short video.

    >>> chunk_spans(900, 300, 50)[1]
    ChunkSpan(begin=250, end=650)
    """
    count = max(1, round(frames / length)) if frames >= LONGER * length else 1
    edges = [n * frames // count for n in range(count)]
    ends = [*(edge + warm_up for edge in edges[1:]), None]
    return tuple(ChunkSpan(max(0, b - warm_up), e) for b, e in zip(edges, ends, strict=True))


@dataclass(frozen=True, slots=True)
class Cutting:
    """How videos are cut.

    Attributes:
        chunk_s: Length of a chunk without the overlap, seconds.
        warm_up_s: Overlap before and after, seconds.
    """

    chunk_s: float
    warm_up_s: float = WARM_UP_S

    def spans(self, settings: WatchSettings) -> tuple[ChunkSpan, ...]:
        """The chunks of the source; none if it is short or of unknown length.

        Raises:
            SourceError: It cannot be opened.
        """
        from visup.runs.wiring import open_video  # heavy import, not needed to parse a command line

        with open_video(settings) as source:
            frames, fps = source.frame_count, source.fps
        length, warm_up = (max(1, round(s * fps)) for s in (self.chunk_s, self.warm_up_s))
        found = chunk_spans(frames or 0, length, warm_up)
        return found if len(found) > 1 else ()

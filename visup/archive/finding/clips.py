"""Cuts hits out of the footage, if it still exists."""

from __future__ import annotations

from pathlib import Path

from visup.agent.model.errors import SourceError
from visup.archive.finding.pattern_evaluator import Hit
from visup.percepts.video.open import open_source
from visup.report.video import WebmWriter

BEFORE_S = 1.0
AFTER_S = 1.0
"""Seconds shown before and after a hit."""


def cut_hits(clip: str, run: str, hits: tuple[Hit, ...], folder: Path) -> list[Path]:
    """Write a video of each hit.

    Args:
        clip: The source of the run.
        run: Its key; the videos are named for it and their time.
        hits: Hits by time.
        folder: Folder for the videos; created if missing.

    Returns:
        The videos. Hits that overlap, with a second before and after, share one.

    Raises:
        SourceError: The footage is missing or cannot be read.
        OutputError: A video cannot be written.
    """
    if not Path(clip).exists():
        raise SourceError(
            "the footage is not there any more, so that nothing can be cut out of it", where=clip
        )
    folder.mkdir(parents=True, exist_ok=True)
    written = []
    for begin, end in spans(hits):
        path = folder / f"{Path(clip).stem}-{run[:8]}-{begin:.1f}s.webm"
        if _cut(clip, begin, end, path):
            written.append(path)
    return written


def spans(hits: tuple[Hit, ...]) -> list[tuple[float, float]]:
    """The intervals to cut: hits with a second before and after, overlapping ones merged."""
    found: list[tuple[float, float]] = []
    for begin, end in sorted((max(0.0, h.begin - BEFORE_S), h.end + AFTER_S) for h in hits):
        if found and begin <= found[-1][1]:
            found[-1] = found[-1][0], max(end, found[-1][1])
        else:
            found.append((begin, end))
    return found


def _cut(clip: str, begin: float, end: float, path: Path) -> bool:
    """Write the frames between two times; returns whether there were any."""
    with open_source(clip) as source, WebmWriter(path, max(1.0, source.fps)) as writer:
        for frame in source:
            if frame.time > end:
                break
            if frame.time >= begin:
                writer.write(frame.image)
    return path.exists()

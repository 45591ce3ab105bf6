"""A run in a few lines: how many objects there were, the busiest pair, the longest stay."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Set

from visup.narrative.visit_sentences import object_label
from visup.narrative.visits import VisitLog

MAX_PATHS = 2
"""Maximum number of paths counted in the first line."""


def summary_lines(log: VisitLog, paths: Mapping[str, Set[int]]) -> Iterator[str]:
    """The summary of a finished run.

    Args:
        log: The visits of the run.
        paths: Path, as a clause -> ids of the objects that took it.
    """
    if not log.count:
        yield "Seen: no object that moved."
        return
    objects = "1 object" if log.count == 1 else f"{log.count} objects"
    at_once = f", at most {log.most_at_once} at a time" if log.count > 1 else ""
    yield f"Seen: {objects}{at_once}{_common_paths(paths)}."
    if log.longest is not None:
        yield (
            f"Longest in view: {object_label(log.longest)}, {log.longest.seconds:.1f} s, "
            f"last {log.longest.end_place}."
        )
    if log.near_s:
        pair = min(log.near_s, key=lambda p: (-log.near_s[p], p))
        gap = log.gaps[pair]
        closest = f"at the closest {gap:.0f} px apart" if gap >= 0.5 else "touching in the picture"
        yield (
            f"Busiest pair: objects {pair[0]} and {pair[1]}, near each other for "
            f"{log.near_s[pair]:.1f} s, {closest}."
        )


def _common_paths(paths: Mapping[str, Set[int]]) -> str:
    """The most frequent paths: `; 5 crossed from left to right`."""
    shared = sorted(((len(ids), what) for what, ids in paths.items() if len(ids) > 1), reverse=True)
    phrases = [f"{count} {what}" for count, what in shared[:MAX_PATHS]]
    return f"; {', '.join(phrases)}" if phrases else ""

"""A run in a few lines: how many objects there were, the busiest pair, the longest stay."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Set

from visup.story.life_sentences import who
from visup.story.lives import LifeLog

MOST_COURSES = 2
"""So many things that several objects did are counted in the first line."""


def summary_lines(log: LifeLog, courses: Mapping[str, Set[int]]) -> Iterator[str]:
    """The summary of a finished run.

    Args:
        log: Of the run.
        courses: What objects did -> the ids of those that did it.
    """
    if not log.count:
        yield "Seen: no object that moved."
        return
    objects = "1 object" if log.count == 1 else f"{log.count} objects"
    at_once = f", at most {log.most_at_once} at a time" if log.count > 1 else ""
    yield f"Seen: {objects}{at_once}{_most_usual(courses)}."
    if log.longest is not None:
        yield (
            f"Longest in view: {who(log.longest)}, {log.longest.seconds:.1f} s, "
            f"last {log.longest.ended_at}."
        )
    if log.together:
        pair = min(log.together, key=lambda p: (-log.together[p], p))
        gap = log.gaps[pair]
        closest = f"at the closest {gap:.0f} px apart" if gap >= 0.5 else "touching in the picture"
        yield (
            f"Busiest pair: objects {pair[0]} and {pair[1]}, near each other for "
            f"{log.together[pair]:.1f} s, {closest}."
        )


def _most_usual(courses: Mapping[str, Set[int]]) -> str:
    """What most objects did: `; 5 crossed from left to right`."""
    shared = sorted(
        ((len(ids), what) for what, ids in courses.items() if len(ids) > 1), reverse=True
    )
    told = [f"{count} {what}" for count, what in shared[:MOST_COURSES]]
    return f"; {', '.join(told)}" if told else ""

"""Reported relations of actors with their end times, so that incompatible ones are not reported to overlap.

Relations are detected late and backdated, so two incompatible ones may overlap by some tenths of a second.
Each is correct by itself, but reported together they contradict each other. The first report prevails: an
incompatible relation is reported to begin no sooner than that ended.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from types import MappingProxyType

ReportedRelations = tuple[tuple[tuple[str, ...], str, float], ...]
"""(actors in alphabetical order, relation, time until which it was reported in seconds) of each report."""

_JOINED = frozenset({"coupled", "held_by", "moving_together"})
_EXCLUDED: Mapping[str, frozenset[str]] = MappingProxyType(
    {
        "converging": _JOINED | {"diverging", "touching", "in_contact", "on", "keeping_distance"},
        "diverging": _JOINED | {"converging", "keeping_distance"},
    }
)


def excludes(first: str, second: str) -> bool:
    """Whether two relations are never reported for the same time.

    >>> excludes("touching", "converging"), excludes("touching", "diverging")
    (True, False)
    """
    return second in _EXCLUDED.get(first, ()) or first in _EXCLUDED.get(second, ())


def with_reported(
    reported: ReportedRelations, actors: Iterable[str], relation: str, until: float
) -> ReportedRelations:
    """The reports so far, with a relation reported to hold until a time."""
    pair = tuple(sorted(actors))
    same = [t for t in reported if t[:2] == (pair, relation)]
    until = max((until, *(t[2] for t in same)))
    return (*(t for t in reported if t not in same), (pair, relation, until))


def merged_reports(parts: Iterable[ReportedRelations]) -> ReportedRelations:
    """Several sets of reports merged, each relation once."""
    found: dict[tuple[tuple[str, ...], str], float] = {}
    for pair, relation, until in (t for part in parts for t in part):
        earlier = found.pop((pair, relation), until)  # the last one merged stands last
        found[pair, relation] = max(until, earlier)
    return tuple((pair, relation, until) for (pair, relation), until in found.items())


def since_reported(
    reported: ReportedRelations, actors: Iterable[str], relation: str, since: float
) -> float:
    """When to report that a relation began, given when it did (`since`), seconds."""
    pair = tuple(sorted(actors))
    return max((since, *(t[2] for t in reported if t[0] == pair and excludes(t[1], relation))))

"""What was told of actors, and until when: what excludes it is told to have begun no sooner.

Relations are noticed late and dated back, so that two that exclude each other may overlap for some
tenths of a second. Each is right by itself; told beside each other they are not. What was told first
stands.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from types import MappingProxyType

Told = tuple[tuple[tuple[str, ...], str, float], ...]
"""Actors in alphabetical order, a relation, and until when it was told to be true of them, seconds."""

_JOINED = frozenset({"coupled", "held_by", "moving_together"})
_EXCLUDED: Mapping[str, frozenset[str]] = MappingProxyType(
    {
        "converging": _JOINED | {"diverging", "touching", "in_contact", "on", "keeping_distance"},
        "diverging": _JOINED | {"converging", "keeping_distance"},
    }
)


def excludes(first: str, second: str) -> bool:
    """Whether two relations are not told for the same time.

    >>> excludes("touching", "converging"), excludes("touching", "diverging")
    (True, False)
    """
    return second in _EXCLUDED.get(first, ()) or first in _EXCLUDED.get(second, ())


def with_told(told: Told, actors: Iterable[str], relation: str, until: float) -> Told:
    """What was told, with a relation that was told to be true until then."""
    who = tuple(sorted(actors))
    same = [t for t in told if t[:2] == (who, relation)]
    until = max((until, *(t[2] for t in same)))
    return (*(t for t in told if t not in same), (who, relation, until))


def joined(parts: Iterable[Told]) -> Told:
    """What was told by several together, each relation once."""
    found: Told = ()
    for who, relation, until in (t for part in parts for t in part):
        found = with_told(found, who, relation, until)
    return found


def since_told(told: Told, actors: Iterable[str], relation: str, since: float) -> float:
    """Since when a relation is told to be true, of which it is known since when it is, seconds."""
    who = tuple(sorted(actors))
    return max((since, *(t[2] for t in told if t[0] == who and excludes(t[1], relation))))

"""Matching of words to the arguments of relations, facts and quantities."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from types import MappingProxyType

from visup.rules.predicates.qualitative_words import ALLEN_RELATIONS, TPCC_RELATIONS
from visup.rules.predicates.snapshot import RELATION_NAMES
from visup.rules.predicates.vocabulary import PERCEPT_KINDS

EXAMPLES: Mapping[str, str] = MappingProxyType(
    {
        "relation": "converging", "kind": "region", "name": "satellite", "zone": "bay",
        "signal": "battery", "word": "auto", "allen": "before", "tpcc": "csf",
    }
)  # fmt: skip
"""Kind of argument -> an example."""
_KNOWN: Mapping[str, Iterable[str]] = MappingProxyType(
    {
        "relation": RELATION_NAMES,
        "kind": PERCEPT_KINDS,
        "allen": ALLEN_RELATIONS,
        "tpcc": TPCC_RELATIONS,
    }
)
OTHERS = "bacde"
"""Names for objects without one."""


def known_of(wanted: str, word: str, scope: Sequence[str]) -> Iterable[str]:
    """The words allowed for a kind of argument; `word` itself where any is."""
    if wanted == "object":
        return scope
    return (*PERCEPT_KINDS, word) if wanted == "kind" else _KNOWN.get(wanted, (word,))


def fits(wanted: str, word: str, scope: Sequence[str]) -> bool:
    """Whether a word is certainly meant as an argument of a kind.

    Args:
        wanted: The kind.
        word: The written word.
        scope: The names of objects.
    """
    if wanted == "object":
        return word in scope
    return word in _KNOWN[wanted] if wanted in _KNOWN else word not in scope


def arranged(name: str, words: Sequence[str], takes: Sequence[str], scope: Sequence[str]) -> str:
    """A call with its words rearranged to fit, and missing arguments filled in.

    >>> arranged("named", ["satellite", "a"], ["object", "name"], ["a", "b"])
    'named(a, satellite)'

    Args:
        name: The called name.
        words: Its arguments as written.
        takes: The kinds of its arguments.
        scope: The names of objects; if there are too few, others are bound by `exists`.
    """
    left = list(words)
    found: list[str | None] = []
    for wanted in takes:
        fitting = next((w for w in left if fits(wanted, w, scope)), None)
        found.append(fitting)
        if fitting is not None:
            left.remove(fitting)
    spare = iter([v for v in dict.fromkeys((*scope, *OTHERS)) if v not in found])
    said = [
        w or (next(spare) if t == "object" else EXAMPLES.get(t, "name"))
        for w, t in zip(found, takes, strict=True)
    ]
    call = f"{name}({', '.join(said)})"
    unbound = [w for w, t in zip(said, takes, strict=True) if t == "object" and w not in scope]
    if not unbound or not scope:
        return call
    return f"({' '.join(f'exists {w}:' for w in unbound)} {call})"


def distinct(words: Sequence[str], scope: Sequence[str]) -> list[str]:
    """Words with repeated ones replaced by others."""
    found: list[str] = []
    for n, word in enumerate(words):
        spare = (v for v in (*scope, *OTHERS) if v not in found and v not in words[n + 1 :])
        found.append(next(spare) if word in found else word)
    return found

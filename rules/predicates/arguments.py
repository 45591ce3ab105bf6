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
SPARE_NAMES = "bacde"
"""Names for objects without one."""


def allowed_words(kind: str, word: str, scope: Sequence[str]) -> Iterable[str]:
    """The words allowed for a kind of argument; `word` itself where any is."""
    if kind == "object":
        return scope
    return (*PERCEPT_KINDS, word) if kind == "kind" else _KNOWN.get(kind, (word,))


def fits(kind: str, word: str, scope: Sequence[str]) -> bool:
    """Whether a word is certainly meant as an argument of a kind.

    Args:
        kind: The kind.
        word: The written word.
        scope: The names of objects.
    """
    if kind == "object":
        return word in scope
    return word in _KNOWN[kind] if kind in _KNOWN else word not in scope


def rearranged_call(
    name: str, words: Sequence[str], kinds: Sequence[str], scope: Sequence[str]
) -> str:
    """A call with its words rearranged to fit, and missing arguments filled in.

    >>> rearranged_call("named", ["satellite", "a"], ["object", "name"], ["a", "b"])
    'named(a, satellite)'

    Args:
        name: The called name.
        words: Its arguments as written.
        kinds: The kinds of its arguments.
        scope: The names of objects; if there are too few, others are bound by `exists`.
    """
    remaining = list(words)
    found: list[str | None] = []
    for kind in kinds:
        fitting = next((w for w in remaining if fits(kind, w, scope)), None)
        found.append(fitting)
        if fitting is not None:
            remaining.remove(fitting)
    spare = iter([v for v in dict.fromkeys((*scope, *SPARE_NAMES)) if v not in found])
    filled = [
        w or (next(spare) if t == "object" else EXAMPLES.get(t, "name"))
        for w, t in zip(found, kinds, strict=True)
    ]
    call = f"{name}({', '.join(filled)})"
    unbound = [w for w, t in zip(filled, kinds, strict=True) if t == "object" and w not in scope]
    if not unbound or not scope:
        return call
    return f"({' '.join(f'exists {w}:' for w in unbound)} {call})"


def with_distinct_words(words: Sequence[str], scope: Sequence[str]) -> list[str]:
    """Words with repeated ones replaced by others."""
    found: list[str] = []
    for n, word in enumerate(words):
        spare = (v for v in (*scope, *SPARE_NAMES) if v not in found and v not in words[n + 1 :])
        found.append(next(spare) if word in found else word)
    return found

"""Inputs of each word of the rule language: while they are unknown, so is the word.

Words about the current image read regions. What an object is (`named`, `actor`, `unexpected`) and what a task
expects are beliefs that persist without observations, like votes; they read nothing.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from visup.agent import Mind
from visup.rules.formula.nodes import SIGNAL_WORDS

PERSISTENT_WORDS = frozenset(
    {"expected", "engaged", "unexpected", "actor", "named", "identified", "of_kind"}
)
"""Words about beliefs that outlive their evidence."""

_PERCEPTS_READ: Mapping[str, frozenset[str]] = MappingProxyType(
    {
        **dict.fromkeys(PERSISTENT_WORDS, frozenset()),
        "stale": frozenset(),  # it is about missing inputs itself
        "healthy": frozenset({"health"}),
        **dict.fromkeys(SIGNAL_WORDS, frozenset({"signal"})),
        **dict.fromkeys(("depth", "depth_difference"), frozenset({"region", "depth"})),
        "spin": frozenset({"region", "hypothesis"}),
    }
)


def percepts_read(word: str) -> frozenset[str]:
    """Kinds of percept that a word reads; regions by default."""
    return _PERCEPTS_READ.get(word, frozenset({"region"}))


def inputs_missing(mind: Mind, word: str) -> bool:
    """Whether something that a word reads is unknown now."""
    return bool(mind.unknown) and not mind.unknown.isdisjoint(percepts_read(word))

"""Words of rules for signals from outside the image, from percepts of kind `signal`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from visup.agent import Mind
from visup.rules.formula.truth import MAYBE, NO, YES
from visup.rules.predicates.snapshot import Codes, Floats, Snapshot

PERCEPT_KIND = "signal"


def known_signals(mind: Mind) -> Mapping[str, Any]:
    """Current signals, by name; for the same name the last report counts."""
    reports = (p.value for p in mind.percepts.get(PERCEPT_KIND, ()) if isinstance(p.value, Mapping))
    return {name: value for values in reports for name, value in values.items()}


def number(facts: Snapshot, name: str) -> Floats:
    """A numeric signal, as an interval; unknown for any other."""
    value = number_of(known_signals(facts.mind).get(name))
    return np.array([-np.inf, np.inf] if value is None else [value, value])


def is_on(facts: Snapshot, name: str) -> Codes:
    """Whether a signal is true, or a nonzero number; unknown for a word."""
    value = known_signals(facts.mind).get(name)
    is_number = isinstance(value, bool | np.bool_) or number_of(value) is not None
    return _code(bool(value) if is_number else None)


def is_word(facts: Snapshot, name: str, word: str) -> Codes:
    """Whether a signal is that word; unknown while the signal is."""
    value = known_signals(facts.mind).get(name)
    return _code(None if value is None else value == word)


def is_known(facts: Snapshot, name: str) -> Codes:
    """Whether a signal is known."""
    return _code(known_signals(facts.mind).get(name) is not None)


def number_of(value: Any) -> float | None:
    """A signal as a number; None if it is not one."""
    is_number = isinstance(value, int | float | np.integer | np.floating)
    if not is_number or isinstance(value, bool) or not np.isfinite(value):
        return None
    return float(value)


def _code(value: bool | None) -> Codes:
    return np.array(MAYBE if value is None else YES if value else NO, dtype=np.int8)

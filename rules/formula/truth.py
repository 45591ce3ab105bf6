"""Kleene's three-valued logic: unknown is never taken for false.

Public interfaces and records use `Truth`. Arrays hold int8 codes instead, and temporal operators hold
robustness intervals; the conversions are here and in `monitoring.intervals.verdict`.

"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from types import MappingProxyType

from visup.agent import Truth

YES, MAYBE, NO = 1, 0, -1
"""Codes of true, unknown and false in arrays."""
CODE_OF: Mapping[Truth, int] = MappingProxyType(
    {Truth.TRUE: YES, Truth.UNKNOWN: MAYBE, Truth.FALSE: NO}
)
TRUTH_OF: Mapping[int, Truth] = MappingProxyType({code: truth for truth, code in CODE_OF.items()})
NEGATION: Mapping[Truth, Truth] = MappingProxyType(
    {truth: TRUTH_OF[-code] for truth, code in CODE_OF.items()}
)


def conjunction(truths: Iterable[Truth]) -> Truth:
    """'and': the minimum.

    >>> conjunction([Truth.TRUE, Truth.UNKNOWN])
    <Truth.UNKNOWN: 'unknown'>
    """
    return min(truths, key=CODE_OF.__getitem__)


def disjunction(truths: Iterable[Truth]) -> Truth:
    """'or': the maximum."""
    return max(truths, key=CODE_OF.__getitem__)


def truth_if(holds: bool) -> Truth:
    """True or false."""
    return Truth.TRUE if holds else Truth.FALSE

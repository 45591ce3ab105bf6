"""The coarser connection calculi RCC-5 and RCC-2 of boxes, merged from RCC-8.

On truth codes, the maximum is "or" and the negative "not", including unknown.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType

import numpy as np

from visup.rules.predicates.snapshot import Codes, Snapshot

PairEvaluator = Callable[[Snapshot], Codes]


def _one_of(*names: str) -> PairEvaluator:
    return lambda facts: np.max([facts.relation_codes(n) for n in names], axis=0)


def _none_of(*names: str) -> PairEvaluator:
    return lambda facts: -np.max([facts.relation_codes(n) for n in names], axis=0)


COARSE_RELATIONS: Mapping[str, tuple[PairEvaluator, str]] = MappingProxyType(
    {
        "connected": (_none_of("disconnected"), "the boxes share a point"),
        "discrete": (
            _one_of("disconnected", "externally_connected"),
            "the boxes share no more than an edge",
        ),
        "overlapping": (
            _none_of("disconnected", "externally_connected"),
            "the boxes share an area",
        ),
        "proper_part": (
            _one_of("tangential_proper_part", "non_tangential_proper_part"),
            "the first box lies in the second",
        ),
        "proper_part_inverse": (
            _one_of("tangential_proper_part_inverse", "non_tangential_proper_part_inverse"),
            "the second box lies in the first",
        ),
    }
)
"""Word -> its evaluation, and its meaning in one clause."""

"""The forward algorithm over hypotheses that are made as they are needed.

Each hypothesis has its mass, the probability of all ways that lead to it together, and the
probability of the best of these ways. Ways that lead to the same hypothesis are merged: masses
add up, and what is remembered is what the best way remembers (Viterbi). What is dropped is
accounted for: at the time of dropping, given all that was seen until then, the truth is among it
with the probability of its mass. Summed over time that bounds how often the truth is ever lost.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Generic, TypeVar

H = TypeVar("H")
K = TypeVar("K", bound=Hashable)


@dataclass(frozen=True, slots=True)
class Weighted(Generic[H]):
    """What is remembered by a hypothesis, with its weights.

    Attributes:
        value: The hypothesis, with what the best way to it remembers.
        mass: Probability, given all that was seen.
        best: Probability of the best way to it, relative to the best of all.
    """

    value: H
    mass: float
    best: float


@dataclass(frozen=True, slots=True)
class Pruned(Generic[K, H]):
    """The belief after one step.

    Attributes:
        retained: Hypotheses by key; their masses sum to 1. Empty when nothing has any mass.
        dropped: Share of the mass that was dropped in this step.
        evidence: Mass before it was made to sum to 1: how likely what was seen is, given all that
            was seen before.
    """

    retained: Mapping[K, Weighted[H]] = field(default_factory=dict)
    dropped: float = 0.0
    evidence: float = 0.0


def merged(grown: Iterable[tuple[K, H, float, float]]) -> dict[K, Weighted[H]]:
    """Ways by where they lead: masses add up, the best way is remembered.

    Args:
        grown: (key, what is remembered, mass, probability of the best way) of each way.
    """
    found: dict[K, tuple[H, float, float]] = {}
    for key, value, mass, best in grown:
        other = found.get(key)
        if other is None:
            found[key] = (value, mass, best)
        elif best > other[2]:
            found[key] = (value, mass + other[1], best)
        else:
            found[key] = (other[0], mass + other[1], other[2])
    return {key: Weighted(*values) for key, values in found.items()}


def pruned(found: Mapping[K, Weighted[H]], most: int, least: float) -> Pruned[K, H]:
    """The heaviest hypotheses, the heaviest first, with masses that sum to 1.

    Args:
        found: All of them.
        most: How many are retained at most.
        least: What has a smaller share of the mass than this is dropped.
    """
    total = sum(w.mass for w in found.values())
    if total <= 0.0:
        return Pruned()
    retained = [(k, w) for k, w in found.items() if w.mass >= least * total]
    retained.sort(key=lambda item: -item[1].mass)
    del retained[most:]
    remains = sum(w.mass for _, w in retained)
    highest = max(w.best for _, w in retained)
    scale = 1.0 / highest if highest > 0.0 else 0.0
    even = {k: Weighted(w.value, w.mass / remains, w.best * scale) for k, w in retained}
    return Pruned(even, max(0.0, 1.0 - remains / total), total)

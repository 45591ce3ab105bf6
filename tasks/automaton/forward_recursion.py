"""The forward algorithm over hypotheses created on demand.

Each hypothesis has a mass, the total probability of all paths to it, and the probability of the best of these
paths. Paths to the same hypothesis are merged: masses are summed, and the history of the best path is kept
(Viterbi). Dropped mass is recorded: given the evidence at that time, it is the probability that the truth is
dropped. Summed over time it bounds how often the truth is lost.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Generic, TypeVar

H = TypeVar("H")
K = TypeVar("K", bound=Hashable)


@dataclass(frozen=True, slots=True)
class Weighted(Generic[H]):
    """A hypothesis with its weights.

    Attributes:
        value: The hypothesis with the history of its best path.
        mass: Posterior probability.
        best: Probability of its best path, relative to the best of all.
    """

    value: H
    mass: float
    best: float


@dataclass(frozen=True, slots=True)
class Pruned(Generic[K, H]):
    """The belief after one step.

    Attributes:
        retained: Hypotheses by key; their masses sum to 1. Empty if no mass is left.
        dropped: Share of the mass dropped in this step.
        evidence: Mass before normalisation: the likelihood of the observation given all previous ones.
    """

    retained: Mapping[K, Weighted[H]] = field(default_factory=dict)
    dropped: float = 0.0
    evidence: float = 0.0


def merged(grown: Iterable[tuple[K, H, float, float]]) -> dict[K, Weighted[H]]:
    """Merge paths by hypothesis: masses are summed, the best path is kept.

    Args:
        grown: (key, hypothesis, mass, probability of the best path) of each path.
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
    """The hypotheses with the largest masses in decreasing order, normalised to 1.

    Args:
        found: All hypotheses.
        most: Maximum number to retain.
        least: Hypotheses with a smaller share of the mass are dropped.
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

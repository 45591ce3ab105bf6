"""Which of several tasks are going on, told from how well each explains what is seen.

Each task gathers evidence: the logarithm of how likely what is seen of its actions is if it is going on,
against a scene in which it is not (`Follower.gain`). Evidence fades, so that a task that was done long
ago makes room. Tasks that share an object are rivals: at most one of them is going on, or none. That none
is stays a rival until one has been believed; after that a task that goes badly is one that fails, not
one that never was, unless a rival explains better what is seen.

The approximation: evidence is taken along the likeliest reading of each task, not summed over all of
them, and rivals that share no object are taken to be independent.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

FADES_S = 20.0
"""Evidence is forgotten with this time constant, seconds."""

MOST = 12.0
"""Evidence for or against a task is never stronger than this, natural logarithm."""

SURE = 0.9
"""Once some task is so likely to be going on, that none is is out of the question."""

AUDIBLE = 0.3
"""A task less likely than this to be going on is not told about."""


@dataclass(frozen=True, slots=True)
class Activity:
    """What is believed of whether a task is going on.

    Attributes:
        evidence: Logarithm of how much likelier what was seen is if it is.
        chance: How likely it is going on, 0 to 1.
        begun: Whether it or a rival was once believed to be.
    """

    evidence: float = 0.0
    chance: float = 0.0
    begun: bool = False

    @property
    def audible(self) -> bool:
        """Whether it is likely enough to be told about."""
        return self.chance >= AUDIBLE


ALONE = Activity(MOST, 1.0, True)
"""A task that is the only one given is taken to be going on."""


def weighed(
    before: Sequence[Activity], gains: Sequence[float], cast: Sequence[frozenset[int]], dt: float
) -> tuple[Activity, ...]:
    """How likely each of several tasks is going on.

    Args:
        before: What was believed of each.
        gains: The evidence of the last `dt` seconds for each.
        cast: The objects that play the actors of each.
        dt: Seconds.

    Returns:
        One for each, in order.
    """
    if len(before) == 1:
        return (ALONE,)
    fade = math.exp(-dt / FADES_S)
    evidence = [
        max(-MOST, min(MOST, fade * a.evidence + gain))
        for a, gain in zip(before, gains, strict=True)
    ]
    found: dict[int, Activity] = {}
    for group in rivals(cast):
        begun = any(before[k].begun for k in group)
        chances = shares([evidence[k] for k in group], none=not begun)
        begun = begun or sum(chances) >= SURE
        found |= {k: Activity(evidence[k], p, begun) for k, p in zip(group, chances, strict=True)}
    return tuple(found[k] for k in range(len(before)))


def shares(evidence: Sequence[float], none: bool) -> list[float]:
    """The probability of each of some rivals; with `none` they may sum to less than 1."""
    top = max(*evidence, 0.0) if none else max(evidence)
    masses = [math.exp(e - top) for e in evidence]
    # All rivals together are as likely beforehand as that none is going on.
    idle = len(masses) * math.exp(-top) if none else 0.0
    whole = sum(masses) + idle
    return [m / whole for m in masses]


def rivals(cast: Sequence[frozenset[int]]) -> Iterator[tuple[int, ...]]:
    """Groups of tasks that are linked by objects that they share; one that shares none stands alone."""
    left = list(range(len(cast)))
    while left:
        group = [left.pop(0)]
        objects = set(cast[group[0]])
        grown = True
        while grown:
            more = [k for k in left if cast[k] & objects]
            grown = bool(more)
            for k in more:
                left.remove(k)
                group.append(k)
                objects |= cast[k]
        yield tuple(sorted(group))

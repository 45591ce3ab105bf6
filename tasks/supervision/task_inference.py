"""Which of several tasks are in progress, inferred from how well each explains the observations.

Each task gathers evidence: the logarithm of how likely what is seen of its actions is if it is going on,
against a scene in which it is not (`Follower.gain`). Evidence fades, so that a task that was done long
ago makes room. Tasks that share an object are rivals: at most one of them is going on, or none. That none
is stays a rival until one has been believed; after that a task that goes badly is one that fails, not
one that never was, unless a rival explains better what is seen.

The approximation: evidence is taken along the likeliest hypothesis of each task, not summed over all of
them, and that a hypothesis passed over a step is not held against its task; tasks that share no object are
taken to be independent. So a task whose end alone is seen may be taken to be going on.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

FADES_S = 20.0
"""Evidence is forgotten with this time constant, seconds."""

MOST = 12.0
"""Evidence for or against a task is never stronger than this, natural logarithm."""

IDLE = 3.0
"""How much likelier it is beforehand that none of some rivals is going on than that one of them is."""

SURE = 0.9
"""Once some task is so likely to be going on, that none is is out of the question."""

REPORTABLE = 0.3
"""A task less likely than this to be going on is not told about."""

EXCLUDED = 0.05
"""What a task less likely than this asks for is not expected."""


@dataclass(frozen=True, slots=True)
class TaskActivity:
    """The belief about whether a task is in progress.

    Attributes:
        evidence: Logarithm of how much likelier what was seen is if it is.
        chance: How likely it is going on, 0 to 1.
        begun: Whether it or a rival was once believed to be.
        ended: Whether it was, and is over.
    """

    evidence: float = 0.0
    chance: float = 0.0
    begun: bool = False
    ended: bool = False

    @property
    def reportable(self) -> bool:
        """Whether it is likely enough to be reported on."""
        return self.chance >= REPORTABLE

    @property
    def excluded(self) -> bool:
        """Whether it is so unlikely that its requirements are not expected."""
        return self.chance < EXCLUDED


ALONE = TaskActivity(MOST, 1.0, True)
"""A task that is the only one given is taken to be going on."""

ENDED = TaskActivity(MOST, 1.0, True, True)
"""A task that was going on, and is over."""


def updated_activities(
    before: Sequence[TaskActivity],
    gains: Sequence[float],
    cast: Sequence[frozenset[int]],
    dt: float,
    over: Sequence[bool] | None = None,
) -> tuple[TaskActivity, ...]:
    """The probability that each of several tasks is in progress.

    Args:
        before: What was believed of each.
        gains: The evidence of the last `dt` seconds for each.
        cast: The objects that play the actors of each.
        dt: Seconds.
        over: Which of them have ended, well or badly; none by default. What was seen is explained by
            them, so that their rivals begin anew.

    Returns:
        One for each, in order.
    """
    if len(before) == 1:
        return (ALONE,)
    ended = over or [False] * len(before)
    found: dict[int, TaskActivity] = {}
    for group in rivals(cast):
        open_ones = [k for k in group if not ended[k]]
        anew = any(ended[k] and not before[k].ended for k in group)
        old = [TaskActivity() if anew else before[k] for k in open_ones]
        new = _rivalling(old, [gains[k] for k in open_ones], dt)
        found |= dict(zip(open_ones, new, strict=True))
        found |= {k: ENDED for k in group if ended[k]}
    return tuple(found[k] for k in range(len(before)))


def _rivalling(
    before: Sequence[TaskActivity], gains: Sequence[float], dt: float
) -> Iterator[TaskActivity]:
    """The same for rivals of which none has ended."""
    if not before:
        return
    begun = any(a.begun for a in before)
    fade = math.exp(-dt / FADES_S)
    counted = zip(before, _counted(gains, begun), strict=True)
    evidence = [fade * a.evidence + gain for a, gain in counted]
    most = max(0.0, max(evidence) - MOST)  # what is beyond tells rivals apart all the same
    evidence = [max(-MOST, e - most) for e in evidence]
    chances = shares(evidence, none=not begun)
    begun = begun or sum(chances) >= SURE
    for e, chance in zip(evidence, chances, strict=True):
        yield TaskActivity(e, chance, begun)


def _counted(gains: Sequence[float], begun: bool) -> Sequence[float]:
    """Losses count against a task that was believed only while a rival gains."""
    if not begun or max(gains) > 0.0:
        return gains
    return [0.0] * len(gains)


def shares(evidence: Sequence[float], none: bool) -> list[float]:
    """The probability of each of some rivals; with `none` they may sum to less than 1."""
    top = max(*evidence, 0.0) if none else max(evidence)
    masses = [math.exp(e - top) for e in evidence]
    idle = IDLE * len(masses) * math.exp(-top) if none else 0.0
    whole = sum(masses) + idle
    return [m / whole for m in masses]


def rivals(cast: Sequence[frozenset[int]]) -> Iterator[tuple[int, ...]]:
    """Groups of tasks that are linked by shared objects."""
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

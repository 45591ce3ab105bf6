"""Which of several tasks are in progress, inferred from how well each explains the observations.

The evidence for a task is the log-likelihood ratio of the observations of its actions, in progress against
not in progress (`MonitoredPhases.gain`). It decays, so that a task completed long ago does not block others.
Tasks that share an object are rivals: at most one of them is in progress. That none is in progress is an
alternative until one has been believed; after that a task that goes badly is failing rather than never begun,
unless a rival explains the observations better.

Approximations: evidence is taken along the most likely hypothesis of each task, not summed over all, and
passing over a step is not counted against a task; tasks that share no object are treated as independent. So a
task of which only the end is seen may be considered in progress.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

FADES_S = 20.0
"""Time constant with which evidence fades, seconds."""

MOST = 12.0
"""Limit of the evidence for or against a task, natural logarithm."""

IDLE = 3.0
"""Prior odds that none of some rivals is in progress, per rival."""

SURE = 0.9
"""Total probability of some rivals from which the alternative that none is in progress is excluded."""

REPORTABLE = 0.3
"""A task less likely than this is not reported."""

EXCLUDED = 0.05
"""The requirements of a task less likely than this are not expected."""


@dataclass(frozen=True, slots=True)
class TaskActivity:
    """The belief about whether a task is in progress.

    Attributes:
        evidence: Log-likelihood ratio that it is.
        chance: Probability that it is, 0 to 1.
        begun: Whether it or a rival was once believed to be.
        ended: Whether it was, and has ended.
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
"""The activity of a single task, which is assumed to be in progress."""

ENDED = TaskActivity(MOST, 1.0, True, True)
"""The activity of a task that has ended."""


def updated_activities(
    before: Sequence[TaskActivity],
    gains: Sequence[float],
    cast: Sequence[frozenset[int]],
    dt: float,
    over: Sequence[bool] | None = None,
) -> tuple[TaskActivity, ...]:
    """The probability that each of several tasks is in progress.

    Args:
        before: The previous activities.
        gains: The evidence of the last `dt` seconds for each.
        cast: The objects of the actors of each.
        dt: Seconds.
        over: Which of them have ended, with or without success; none by default. They explain the past
            observations, so that their rivals begin anew.

    Returns:
        The activities, in order.
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
    """The updated activities of rivals of which none has ended; see `updated_activities`."""
    if not before:
        return
    begun = any(a.begun for a in before)
    fade = math.exp(-dt / FADES_S)
    counted = zip(before, _counted(gains, begun), strict=True)
    evidence = [fade * a.evidence + gain for a, gain in counted]
    most = max(
        0.0, max(evidence) - MOST
    )  # shift all by the excess, which preserves their differences
    evidence = [max(-MOST, e - most) for e in evidence]
    chances = shares(evidence, none=not begun)
    begun = begun or sum(chances) >= SURE
    for e, chance in zip(evidence, chances, strict=True):
        yield TaskActivity(e, chance, begun)


def _counted(gains: Sequence[float], begun: bool) -> Sequence[float]:
    """The evidence that counts: if a task is believed in, negative evidence only while some rival gains."""
    if not begun or max(gains) > 0.0:
        return gains
    return [0.0] * len(gains)


def shares(evidence: Sequence[float], none: bool) -> list[float]:
    """The probability of each of some rivals, from their log evidence.

    Args:
        evidence: Log-likelihood ratio of each.
        none: Whether none of them may be in progress, so that the probabilities sum to less than 1.
    """
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

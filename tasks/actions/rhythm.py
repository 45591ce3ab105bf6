"""Periodic actions: whether they keep their period.

A *beat* is a moment in which an action begins to hold. It is in time if it comes between the shortest and the
longest period after the previous beat; the first always is. An action keeps its period while the last beat in
time is no longer ago than the longest period. Unobserved time does not count towards a period.
"""

from __future__ import annotations

from dataclasses import dataclass

from visup.agent import Truth
from visup.agent.model.fast_replace import replace

CLOSE_S = 1e-9
"""Times that differ by less, seconds, are equal."""


@dataclass(frozen=True, slots=True)
class Beats:
    """The beats of an action up to one moment; times in seconds.

    Attributes:
        time: That moment.
        so: Whether the action held when last observed.
        seen_s: Total observed time.
        last: Time of the last beat, or None before the first.
        last_seen_s: Observed time at the last beat.
        good_seen_s: Observed time at the last beat in time.
        since: Since when it has kept its period, or not.
        keeps: Whether it keeps its period.
    """

    time: float
    so: bool = False
    seen_s: float = 0.0
    last: float | None = None
    last_seen_s: float = 0.0
    good_seen_s: float = 0.0
    since: float = 0.0
    keeps: bool = False

    @property
    def late(self) -> bool:
        """Whether there was a beat and the period is no longer kept."""
        return self.last is not None and not self.keeps


def heard(
    before: Beats | None,
    truth: Truth,
    since: float,
    moment: tuple[float, float],
    period: tuple[float, float],
) -> Beats:
    """Update the beats with the present observation.

    Args:
        before: The beats so far, or None.
        truth: Whether the action holds now.
        since: Since when.
        moment: Times of the last update of the task and of now, seconds; without `before` the time between
            was not observed.
        period: The shortest and the longest period, seconds.
    """
    looked, now = moment
    beats = Beats(now, since=now) if before is None else before
    if truth is Truth.UNKNOWN:
        return replace(beats, time=now)
    listened = beats.time >= looked - CLOSE_S
    beats = replace(beats, seen_s=beats.seen_s + (now - beats.time if listened else 0.0))
    if truth is Truth.TRUE and (not beats.so or (before is not None and since > before.time)):
        beats = _with_beat(beats, min(now, max(since, beats.time)), now, period)
    keeps = beats.last is not None and beats.seen_s - beats.good_seen_s <= period[1] + CLOSE_S
    changed = beats.since if keeps is beats.keeps else now
    return replace(beats, time=now, so=truth is Truth.TRUE, keeps=keeps, since=changed)


def _with_beat(beats: Beats, at: float, now: float, period: tuple[float, float]) -> Beats:
    """The beats with a further one."""
    seen_s = beats.seen_s - (now - at)
    good = beats.last is None
    if beats.last is not None:
        soon = at - beats.last < period[0] - CLOSE_S
        good = not soon and seen_s - beats.last_seen_s <= period[1] + CLOSE_S
    good_seen_s = seen_s if good else beats.good_seen_s
    return replace(beats, last=at, last_seen_s=seen_s, good_seen_s=good_seen_s)


@dataclass(frozen=True, slots=True)
class Rhythm:
    """A periodic action.

    Attributes:
        key: Key of its beats.
        holds: Relations any of which means that the action holds.
        period: The shortest and the longest period, seconds.
        late: Whether the condition is that the period is not kept.
    """

    key: str
    holds: tuple[str, ...]
    period: tuple[float, float]
    late: bool = False

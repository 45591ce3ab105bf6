"""What happens again and again: whether it keeps time.

A *beat* is a moment in which something begins to be so. It came in time when it came no sooner than the
shortest period and no later than the longest one after the beat before it; the first one always did. An
action keeps time while the last beat that came in time is no longer ago than the longest period.

What could not be observed is not held against it: such time makes no period too long.
"""

from __future__ import annotations

from dataclasses import dataclass

from visup.agent import Truth
from visup.agent.model.fast_replace import replace

CLOSE_S = 1e-9
"""Times that differ by less are the same."""


@dataclass(frozen=True, slots=True)
class Beats:
    """The beats of an action up to one moment; times in seconds.

    Attributes:
        time: That moment.
        so: Whether it was so when it was last observed.
        seen_s: For how long it has been observed.
        last: When the last beat was, or None before the first.
        last_seen_s: For how long it had been observed then.
        good_seen_s: The same of the last beat that came in time.
        since: Since when it has kept time, or not.
        keeps: Whether it keeps time.
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
        """Whether there was a beat, and it keeps time no more."""
        return self.last is not None and not self.keeps


def heard(
    before: Beats | None,
    truth: Truth,
    since: float,
    moment: tuple[float, float],
    period: tuple[float, float],
) -> Beats:
    """The beats with what is seen now.

    Args:
        before: The beats so far; None where nobody listened.
        truth: Whether it is so now.
        since: Since when.
        moment: When a task was last looked at, and now, seconds: where nobody listened in between, that
            time was not observed.
        period: The shortest and the longest, seconds.
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
    """The beats with one more."""
    seen_s = beats.seen_s - (now - at)
    good = beats.last is None
    if beats.last is not None:
        soon = at - beats.last < period[0] - CLOSE_S
        good = not soon and seen_s - beats.last_seen_s <= period[1] + CLOSE_S
    good_seen_s = seen_s if good else beats.good_seen_s
    return replace(beats, last=at, last_seen_s=seen_s, good_seen_s=good_seen_s)


@dataclass(frozen=True, slots=True)
class Rhythm:
    """An action that is to happen again and again.

    Attributes:
        key: Its key, by which its beats are kept.
        holds: Relations by one of which it is so.
        period: The shortest and the longest, seconds.
        late: Whether what is meant is that it does not keep time.
    """

    key: str
    holds: tuple[str, ...]
    period: tuple[float, float]
    late: bool = False

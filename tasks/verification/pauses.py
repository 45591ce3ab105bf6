"""Pauses of work, and working time: elapsed time without pauses.

Points in time are those of the recording, so that they are reported correctly. Durations are working time,
without the spans in which a pause condition held.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from visup.agent import Relation, Truth
from visup.agent.model.fast_replace import replace
from visup.tasks.grammar.nodes import StageCondition

MAX_SPANS = 64
"""Most pauses stored for one condition; beyond that the two oldest are merged, with their lengths added."""

Span = tuple[float, float]
"""From the last moment of work to the last moment of the pause, seconds."""


@dataclass(frozen=True, slots=True)
class Pause:
    """One pause condition over time.

    Attributes:
        condition: The condition.
        spans: Pauses caused by it, in order.
        paused: Whether it pauses work now.
        since: Time since when the condition holds, if it pauses work now, seconds.
        known: Time when the condition was last observed, seconds.
    """

    condition: StageCondition
    spans: tuple[Span, ...] = ()
    paused: bool = False
    since: float = 0.0
    known: float = 0.0

    def noted(self, seen: Relation, before: float, now: float, patience: float) -> Pause:
        """The pause updated with an observation.

        Args:
            seen: Whether the condition holds, and since when.
            before: Time of the previous update, seconds.
            now: Current time, seconds.
            patience: How long a pause continues while its condition is not observed, seconds.
        """
        if seen.truth is Truth.UNKNOWN:
            paused, since, known = (
                self.paused and now - self.known < patience,
                self.since,
                self.known,
            )
        else:
            paused, since, known = seen.truth is Truth.TRUE, seen.since, now
        spans = self.spans
        if paused and self.paused:
            spans = (*spans[:-1], (spans[-1][0], now))
        elif paused:
            spans = _bounded((*spans, (before, now)))
        return replace(self, spans=spans, paused=paused, since=since, known=known)


@dataclass(frozen=True, slots=True)
class PauseRecord:
    """All pauses of a task up to one moment."""

    pauses: tuple[Pause, ...] = ()

    def noted(
        self,
        conditions: Sequence[StageCondition],
        seen: Callable[[StageCondition], Relation],
        before: float,
        now: float,
        patience: float,
    ) -> PauseRecord:
        """The record updated with observations of some conditions; see `Pause.noted`."""
        if not conditions:
            return self
        known = {p.condition: p for p in self.pauses}
        each = ((c, known.get(c) or Pause(c)) for c in conditions)
        return PauseRecord(tuple([p.noted(seen(c), before, now, patience) for c, p in each]))

    def now(self, conditions: Sequence[StageCondition]) -> Pause | None:
        """The longest current pause of some conditions, or None."""
        paused = (p for p in self._of(conditions) if p.paused)
        return min(paused, key=lambda p: p.spans[-1][0], default=None)

    def elapsed(self, conditions: Sequence[StageCondition], since: float, now: float) -> float:
        """Working time between two times: the seconds in which none of the conditions paused it."""
        spans = [s for p in self._of(conditions) for s in p.spans]
        lost = (min(end, now) - max(start, since) for start, end in _disjoint_spans(spans))
        return now - since - sum(x for x in lost if x > 0.0)

    def _of(self, conditions: Sequence[StageCondition]) -> Iterator[Pause]:
        return (p for p in self.pauses if p.condition in conditions)


NO_PAUSES = PauseRecord()


def _bounded(spans: tuple[Span, ...]) -> tuple[Span, ...]:
    if len(spans) <= MAX_SPANS:
        return spans
    (start, end), (later, until), *others = spans
    return ((later - (end - start), until), *others)


def _disjoint_spans(spans: Sequence[Span]) -> Iterator[Span]:
    """Overlapping spans made disjoint, so that no time is counted twice."""
    reached = float("-inf")
    for start, end in sorted(spans):
        if end > reached:
            yield max(start, reached), end
            reached = end

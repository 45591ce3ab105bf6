"""Temporal operators: each consumes samples and has an immutable state.

A sample is valid from its moment to the next one, but for no longer than `SAMPLE_HOLD`: after that the value
is unknown until the next sample, as it is before the first. Windows are closed; a window includes every piece
of time that it meets. `docs/rules.md` has the full definition, and an oracle in the tests evaluates it a
second time over whole histories.
 Operators that retain only a few numbers per binding of objects (`BooleanWindow`, `Unbounded`,
`SampleAndHold`, `HysteresisLatch`) are executed by `vm` for all bindings at once.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

from visup.rules.monitoring.further_operators import (
    BegunWindow,
    DelayedUnbounded,
    EndedWindow,
    FollowedWindow,
    PreviousSample,
)
from visup.rules.monitoring.intervals import EQUAL, UNKNOWN, Algebra, Interval
from visup.rules.monitoring.samples import SAMPLE_HOLD, SelectObjects, Update, max_samples
from visup.rules.monitoring.sliding import Fold, Queue, SlidingState, initial, mapped, slide


@dataclass(frozen=True)
class SlidingWindow:
    """The minimum or maximum over a window, or `since` or `until` within one.

    Attributes:
        kind: 'always' (minimum), 'once' (maximum), 'since' or 'until'; the last two have two operands.
        low: How long before now the window ends, microseconds.
        high: How long before now it begins.
    """

    kind: str
    low: int
    high: int

    def on(self, algebra: Algebra) -> Update:
        """The update function for a sample of its operands."""
        fold, low, high = self._fold(algebra), self.low, self.high
        nothing = algebra.constant(UNKNOWN)
        unknown = (nothing, nothing) if self._pair else nothing

        def begun(state: SlidingState | None, now: int) -> SlidingState:
            if state is None:
                return initial(now, unknown)
            if now - state[0] > SAMPLE_HOLD:
                return slide(state, state[0] + SAMPLE_HOLD, unknown, low, high, fold)[0]
            return state

        def single(state: SlidingState | None, now: int, value: Any) -> tuple[SlidingState, Any]:
            if state is None or now - state[0] > SAMPLE_HOLD:
                state = begun(state, now)
            return slide(state, now, value, low, high, fold)

        def pair(
            state: SlidingState | None, now: int, left: Any, right: Any
        ) -> tuple[SlidingState, Any]:
            state, joined = slide(begun(state, now), now, (right, left), low, high, fold)
            return state, joined[0]

        return pair if self._pair else single

    def _fold(self, algebra: Algebra) -> Fold:
        """The fold of the values of adjacent pieces of time."""
        least, most = algebra.least, algebra.most

        def since(older: Any, newer: Any) -> Any:
            return most(newer[0], least(older[0], newer[1])), least(older[1], newer[1])

        def until(older: Any, newer: Any) -> Any:
            return most(older[0], least(older[1], newer[0])), least(older[1], newer[1])

        return {"always": least, "once": most, "since": since, "until": until}[self.kind]

    @property
    def _pair(self) -> bool:
        return self.kind in ("since", "until")

    @property
    def kept(self) -> int:
        """Most intervals in the state for one binding of objects."""
        return (2 if self._pair else 1) * (2 * max_samples(self.high) + 2)

    def rows(self, state: SlidingState, pick: SelectObjects) -> SlidingState:
        """The state for other objects; new ones have no past."""
        if self._pair:
            return mapped(state, lambda v: (pick(v[0], UNKNOWN), pick(v[1], UNKNOWN)))
        return mapped(state, lambda v: pick(v, UNKNOWN))


@dataclass(frozen=True)
class BooleanWindow:
    """`for` and `within` of a Boolean: the state is one moment instead of a window.

    Attributes:
        kind: 'always' or 'once'.
        high: Length of the window, microseconds.
    """

    kind: str
    high: int

    @property
    def kept(self) -> int:
        """Most intervals in the state for one binding of objects."""
        return 1


@dataclass(frozen=True)
class Unbounded:
    """`always`, `once` and `since` over the whole past.

    Attributes:
        kind: 'always', 'once' or 'since'.
    """

    kind: str

    @property
    def kept(self) -> int:
        """Most intervals in the state for one binding of objects."""
        return 1


MAYBE: Interval = (0.0, 1.0)


class CountState(NamedTuple):
    """The state of a count.

    Attributes:
        then: Time of the last sample.
        clock: The counter: microseconds, or samples.
        born: The clock at the first sample.
        total: (certainly, possibly) true up to the clock.
        rate: Growth of `total` per unit of the clock from here on.
        begin: (clock, (total, rate)) at the piece that contains the start of the window.
        queue: The same for all later pieces.
    """

    then: int
    clock: int
    born: int
    total: Any
    rate: Any
    begin: tuple[int, tuple[Any, Any]]
    queue: Queue


@dataclass(frozen=True)
class SlidingCount:
    """`f in 60 % of 2 s`, `f in 3 of 5 samples`: by how much the count exceeds the least.

    Attributes:
        least: Share of the time, or number of samples.
        span: Length of the window, microseconds, or number of samples.
        samples: Whether samples are counted.
    """

    least: float
    span: int
    samples: bool

    def on(self, algebra: Algebra) -> Update:
        """The update function for a sample of its operand."""
        a, maybe = algebra, algebra.constant(MAYBE)
        # Counted in integers, so that a count that just suffices is exact.
        enough = -self.least if self.samples else -round(self.least * self.span)

        def step(state: CountState | None, now: int, value: Any) -> tuple[CountState, Any]:
            held = a.held(value)
            if state is None:
                clock, none = 0 if self.samples else now, a.constant((0.0, 0.0))
                state = CountState(now, clock, clock, none, maybe, (clock, (none, maybe)), Queue())
            elif now - state.then > SAMPLE_HOLD:
                moment = state.clock + (0 if self.samples else SAMPLE_HOLD)
                state = self._added(a, state, state.then + SAMPLE_HOLD, moment, maybe)
            clock = state.clock if self.samples else now
            state = self._added(a, state, now, clock, held)
            start = state.clock - self.span
            queue, begin = state.queue.advance(start, state.begin)
            moment, (total, rate) = begin
            before = a.tallied(total, a.scaled(rate, float(start - moment)))
            counted = a.tallied(state.total, a.scaled(before, -1.0))
            over = a.shifted(counted, enough)
            share = over if self.samples else a.scaled(over, 1.0 / self.span)
            return state._replace(queue=queue, begin=begin), a.shifted(share, EQUAL)

        return step

    def _added(self, a: Algebra, state: CountState, now: int, clock: int, held: Any) -> CountState:
        """Add a sample to the count: samples count at once, time while the value lasts."""
        if self.samples:
            clock, total, rate = clock + 1, a.tallied(state.total, held), a.constant((0.0, 0.0))
        else:
            passed = a.scaled(state.rate, float(clock - state.clock))
            total, rate = a.tallied(state.total, passed), held
        queue = state.queue.push(clock, (total, rate))
        return CountState(now, clock, state.born, total, rate, state.begin, queue)

    @property
    def kept(self) -> int:
        """Most intervals in the state for one binding of objects."""
        return 2 * ((self.span if self.samples else max_samples(self.span)) + 2)

    def rows(self, state: CountState, pick: SelectObjects) -> CountState:
        """The state for other objects; new ones have no past."""

        def total(clock: int, value: Any) -> Any:
            return pick(value, (0.0, float(clock - state.born)))

        def piece(clock: int, value: tuple[Any, Any]) -> tuple[Any, Any]:
            return total(clock, value[0]), pick(value[1], MAYBE)

        clock, value = state.begin
        return state._replace(
            total=total(state.clock, state.total),
            rate=pick(state.rate, MAYBE),
            begin=(clock, piece(clock, value)),
            queue=state.queue.changed(piece),
        )


@dataclass(frozen=True)
class SampleAndHold:
    """`last(x, 0.5 s)`: the last known value, while it is not too old.

    Attributes:
        age: Greatest age, microseconds.
    """

    age: int

    @property
    def kept(self) -> int:
        """Most intervals in the state for one binding of objects."""
        return 2


@dataclass(frozen=True)
class HysteresisLatch:
    """A comparison with hysteresis: the second threshold applies while it is true."""

    @property
    def kept(self) -> int:
        """Most intervals in the state for one binding of objects."""
        return 1


@dataclass(frozen=True)
class ValueWhenTrue:
    """`let x be q at f`: the value of q when f was last known true; unknown before."""

    @property
    def kept(self) -> int:
        """Most intervals in the state for one binding of objects."""
        return 1


PointOperator = BooleanWindow | Unbounded | SampleAndHold | HysteresisLatch | ValueWhenTrue
"""Operators whose state is a few numbers per binding of objects."""
WindowOperator = (
    SlidingWindow
    | SlidingCount
    | DelayedUnbounded
    | BegunWindow
    | EndedWindow
    | FollowedWindow
    | PreviousSample
)
"""Operators that retain a whole window, or that `vm` does not implement."""
TemporalOperator = PointOperator | WindowOperator
"""An operator with state."""

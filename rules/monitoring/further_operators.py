"""Further operators: previous samples, delayed values, onsets and ends within a window.

`since` with a lower bound also requires its left side after the window, `until` also before it; `always`,
`once` and `since` without a window ignore verdicts about the time before the first sample. All have immutable
states, like the operators of `operators.py`.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from typing import Any, NamedTuple

from visup.rules.monitoring.intervals import FALSE, TRUE, UNKNOWN, Algebra, Interval
from visup.rules.monitoring.samples import SAMPLE_HOLD, SelectObjects, Update, max_samples
from visup.rules.monitoring.sliding import SlidingState, initial, later, mapped, slide


@dataclass(frozen=True)
class PreviousSample:
    """`previous f`: the value at the previous sample; unknown after a gap."""

    def on(self, algebra: Algebra) -> Update:
        """The update function for a sample of its operand."""
        unknown = algebra.constant(UNKNOWN)

        def step(state: tuple[int, Any] | None, now: int, value: Any) -> tuple[Any, Any]:
            heard = state is not None and now - state[0] <= SAMPLE_HOLD
            return (now, value), state[1] if state is not None and heard else unknown

        return step

    @property
    def kept(self) -> int:
        """Most intervals in the state for one binding of objects."""
        return 1

    def rows(self, state: tuple[int, Any], pick: SelectObjects) -> tuple[int, Any]:
        """The state for other objects; new ones have no past."""
        return state[0], pick(state[1], UNKNOWN)


@dataclass(frozen=True)
class BegunWindow:
    """The minimum over values that began in a window ending now; true if none did.

    Attributes:
        high: Length of the window, microseconds; the value at its start is excluded.
    """

    high: int

    def on(self, algebra: Algebra) -> Update:
        """The update function for a sample of its operand."""
        unknown, nothing = algebra.constant(UNKNOWN), algebra.constant(TRUE)
        least, high = algebra.least, self.high

        def step(state: SlidingState | None, now: int, value: Any) -> tuple[SlidingState, Any]:
            if state is None:
                state = initial(now, unknown)
            elif now - state.then > SAMPLE_HOLD:
                state = slide(state, state.then + SAMPLE_HOLD, unknown, 0, high, least)[0]
            state = slide(state, now, value, 0, high, least)[0]
            return state, later(state, least, nothing)

        return step

    @property
    def kept(self) -> int:
        """Most intervals in the state for one binding of objects."""
        return 2 * max_samples(self.high) + 2

    def rows(self, state: SlidingState, pick: SelectObjects) -> SlidingState:
        """The state for other objects; new ones have no past."""
        return mapped(state, lambda v: pick(v, UNKNOWN))


@dataclass(frozen=True)
class FollowedWindow:
    """Whether, in a window ending now, one formula was true and another at that time or later.

    Attributes:
        high: Length of the window, microseconds.
    """

    high: int

    def on(self, algebra: Algebra) -> Update:
        """The update function for a sample of its operands."""
        least, most, high = algebra.least, algebra.most, self.high
        unknown = (algebra.constant(UNKNOWN),) * 3

        def fold(older: Any, newer: Any) -> Any:
            # (first followed by second, first, second)
            followed = most(most(older[0], newer[0]), least(older[1], newer[2]))
            return followed, most(older[1], newer[1]), most(older[2], newer[2])

        def step(
            state: SlidingState | None, now: int, first: Any, second: Any
        ) -> tuple[SlidingState, Any]:
            if state is None:
                state = initial(now, unknown)
            elif now - state.then > SAMPLE_HOLD:
                state = slide(state, state.then + SAMPLE_HOLD, unknown, 0, high, fold)[0]
            value = least(first, second), first, second
            state, found = slide(state, now, value, 0, high, fold)
            return state, found[0]

        return step

    @property
    def kept(self) -> int:
        """Most intervals in the state for one binding of objects."""
        return 3 * (2 * max_samples(self.high) + 2)

    def rows(self, state: SlidingState, pick: SelectObjects) -> SlidingState:
        """The state for other objects; new ones have no past."""
        return mapped(state, lambda v: tuple(pick(part, UNKNOWN) for part in v))


class EndedState(NamedTuple):
    """The state of `EndedWindow`.

    Attributes:
        standing: The value that has not ended.
        window: The values that have ended, each at its end.
    """

    standing: Any
    window: SlidingState


@dataclass(frozen=True)
class EndedWindow:
    """The minimum over values that ended in a window before now; true if none did.

    Attributes:
        low: How long before now the window ends, microseconds.
        high: How long before now it begins; a value ending exactly there is excluded.
    """

    low: int
    high: int

    def on(self, algebra: Algebra) -> Update:
        """The update function for a sample of its operand."""
        unknown, nothing = algebra.constant(UNKNOWN), algebra.constant(TRUE)
        least, low, high = algebra.least, self.low, self.high

        def step(state: EndedState | None, now: int, value: Any) -> tuple[EndedState, Any]:
            standing, window = state or (unknown, initial(now, unknown))
            if now - window.then > SAMPLE_HOLD:
                silent = window.then + SAMPLE_HOLD
                standing, window = unknown, slide(window, silent, standing, low, high, least)[0]
            window = slide(window, now, standing, low, high, least)[0]
            return EndedState(value, window), later(window, least, nothing)

        return step

    @property
    def kept(self) -> int:
        """Most intervals in the state for one binding of objects."""
        return 2 * max_samples(self.high) + 3

    def rows(self, state: EndedState, pick: SelectObjects) -> EndedState:
        """The state for other objects; new ones have no past."""
        window = mapped(state.window, lambda v: pick(v, UNKNOWN))
        return EndedState(pick(state.standing, UNKNOWN), window)


class LateState(NamedTuple):
    """The state of `DelayedUnbounded`.

    Attributes:
        then: Time of the last sample, microseconds.
        born: Time of the first sample, as a degenerate interval; infinite before it.
        kept: The value so far.
    """

    then: int
    born: Any
    kept: Any


@dataclass(frozen=True)
class DelayedUnbounded:
    """`always`, `once` and `since` of delayed values, from the time of the first sample on.

    The first delayed values are about times before the first sample, which do not count as observed and
    are unknown.

    Attributes:
        kind: 'always', 'once' or 'since'.
        delay: Delay of the operands, microseconds.
    """

    kind: str
    delay: int

    def on(self, algebra: Algebra) -> Update:
        """The update function for a sample of its operands."""
        a, unknown = algebra, algebra.constant(UNKNOWN)
        lasts = self.kind == "always"

        def started(born: Any, moment: int) -> Any:
            """TRUE if a moment is not before the first sample, else FALSE."""
            # Half a microsecond is added to avoid 0, which has no sign.
            return a.scaled(a.shifted(a.scaled(born, -1.0), moment + 0.5), inf)

        def joined(kept: Any, on: Any, *values: Any) -> Any:
            if lasts:
                return a.least(kept, a.most(values[0], a.scaled(on, -1.0)))
            if self.kind == "since":
                kept = a.least(kept, values[0])
            return a.most(kept, a.least(values[-1], on))

        def step(state: LateState | None, now: int, *values: Any) -> tuple[LateState, Any]:
            if state is None:
                state = self._initial(a, now)
            then, born, kept = state
            if now - then > SAMPLE_HOLD:
                on = started(born, then + SAMPLE_HOLD - self.delay)
                kept = joined(kept, on, *(unknown,) * len(values))
            born = a.least(born, a.constant((float(now), float(now))))
            on = started(born, now - self.delay)
            kept = joined(kept, on, *values)
            if lasts:
                reported = a.least(kept, a.most(unknown, on))
            else:
                reported = a.most(kept, a.least(unknown, a.scaled(on, -1.0)))
            return LateState(now, born, kept), reported

        return step

    def _initial(self, algebra: Algebra, now: int) -> LateState:
        return LateState(now, algebra.constant(_UNBORN), algebra.constant(self._empty))

    @property
    def _empty(self) -> Interval:
        return TRUE if self.kind == "always" else FALSE

    @property
    def kept(self) -> int:
        """Most intervals in the state for one binding of objects."""
        return 2

    def rows(self, state: LateState, pick: SelectObjects) -> LateState:
        """The state for other objects; new ones have no past."""
        return LateState(state.then, pick(state.born, _UNBORN), pick(state.kept, self._empty))


_UNBORN: Interval = (inf, inf)

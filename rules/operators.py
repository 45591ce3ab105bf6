"""Operators over time: each takes in one sample and keeps an immutable state.

A sample speaks from its moment to the next one, but for no longer than `REACH`: what comes after is
unknown until the next sample, and so is all before the first. Windows are closed; a window holds
every piece of time that it meets. `docs/rules.md` says it in full, and an oracle in the evaluation
does it a second time over whole histories.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, NamedTuple, Protocol

import numpy as np

from visup.rules.intervals import EQUAL, FALSE, TRUE, UNKNOWN, Algebra, Arrays, Interval
from visup.rules.sliding import Fold, Queue, Slide, changed, slide
from visup.rules.units import ticks

REACH = ticks(0.5)
"""How long one sample speaks for what follows, microseconds."""
SPACING = ticks(0.01)
"""Samples closer than this are not taken in, which bounds what a window holds; microseconds."""
LONG_AGO = -(2**62)


def most_samples(span: int) -> int:
    """Most samples of a span in microseconds, with one for each silence and one at either end."""
    return span // SPACING + span // REACH + 2


Pick = Callable[..., Any]
"""(array, what new rows are filled with, dimensions before those of the objects) -> array."""


class Operator(Protocol):
    """What remembers something of one formula or quantity from sample to sample."""

    def step(self, state: Any, now: int, *values: Any) -> tuple[Any, Any]:
        """Take in the values of the parts at a sample.

        Args:
            state: The state before, or None at the first sample.
            now: Microseconds.
            values: Intervals of the parts.

        Returns:
            The state after, and the interval of the whole.
        """

    def rows(self, state: Any, now: int, pick: Pick) -> Any:
        """The same state for the objects of the sample at `now`; the new ones have no past."""

    @property
    def kept(self) -> int:
        """Most intervals that the state holds for one choice of objects."""


@dataclass(frozen=True)
class Sliding:
    """The least or the greatest over a window, and `since` within one.

    Attributes:
        algebra: Of the intervals.
        kind: 'always' (least), 'once' (greatest), 'since' or 'until'; the last two take two parts.
        low: How long before now the window ends, microseconds.
        high: How long before now it begins.
    """

    algebra: Algebra = field(repr=False)
    kind: str
    low: int
    high: int

    def __post_init__(self) -> None:
        # Looked up once: a step is a few microseconds.
        object.__setattr__(self, "_fold", self.fold())
        unknown = self.algebra.constant(UNKNOWN)
        pair = self.kind in ("since", "until")
        object.__setattr__(self, "_pair", pair)
        object.__setattr__(self, "_copies", isinstance(self.algebra, Arrays))
        object.__setattr__(self, "_unknown", (unknown, unknown) if pair else unknown)

    def fold(self) -> Fold:
        """How the values of neighbouring pieces of time are joined."""
        least, most = self.algebra.least, self.algebra.most

        def since(older: Any, newer: Any) -> Any:
            return most(newer[0], least(older[0], newer[1])), least(older[1], newer[1])

        def until(older: Any, newer: Any) -> Any:
            return most(older[0], least(older[1], newer[0])), least(older[1], newer[1])

        return {"always": least, "once": most, "since": since, "until": until}[self.kind]

    def step(self, state: Slide | None, now: int, *values: Any) -> tuple[Slide, Any]:
        """See `Operator`."""
        fold, unknown = self._fold, self._unknown  # type: ignore[attr-defined]
        if self._copies:  # type: ignore[attr-defined]
            # Values may be those of another step (see `Program.step`). Which ones are must not show in
            # what is kept: going back and forth gives the same states byte for byte.
            values = tuple([v.copy() for v in values])
        if state is None:
            state = Slide(now, unknown)
        elif now - state[0] > REACH:
            state, _ = slide(state, state[0] + REACH, unknown, self.low, self.high, fold)
        if self._pair:  # type: ignore[attr-defined]
            state, joined = slide(state, now, (values[1], values[0]), self.low, self.high, fold)
            return state, joined[0]
        return slide(state, now, values[0], self.low, self.high, fold)

    @property
    def kept(self) -> int:
        """See `Operator`."""
        each = 2 if self._pair else 1  # type: ignore[attr-defined]
        return each * (2 * most_samples(self.high) + 2)

    def rows(self, state: Slide, now: int, pick: Pick) -> Slide:
        """See `Operator`."""
        if self._pair:  # type: ignore[attr-defined]
            return changed(state, lambda v: (pick(v[0], UNKNOWN), pick(v[1], UNKNOWN)))
        return changed(state, lambda v: pick(v, UNKNOWN))


class Ends(NamedTuple):
    """When what ends a run was last there.

    Attributes:
        then: Time of the last sample.
        until: (2, ...) microseconds up to which each bound was not as wanted; of those that are not
            as wanted now it is told once they are again.
        broken: (2, ...) whether it is not as wanted now.
        latest: Latest time of `until`.
        shown: (2, ...) where either bound was not as wanted within the window, and
        result: the interval that follows, both as they were last.
    """

    then: int
    until: Any
    broken: Any
    latest: int
    shown: Any
    result: Any


@dataclass(frozen=True)
class Lasting:
    """`for` and `within` of what is no matter of degree: its state is one moment, not a window.

    Attributes:
        algebra: Of the intervals.
        kind: 'always' or 'once'.
        high: Length of the window, microseconds.
    """

    algebra: Arrays = field(repr=False)
    kind: str
    high: int

    def step(self, state: Ends | None, now: int, *values: Any) -> tuple[Ends, Any]:
        """See `Operator`."""
        value = values[0]
        broken = value < 0 if self.kind == "always" else (value > 0)[::-1]
        if state is None:
            until = np.full_like(broken, LONG_AGO, dtype=np.int64)
            until[0] = now  # before the first sample nothing is known: it may have been false
            latest = now
        else:
            # Nearly always all is as it was, and what is not the time can be shared.
            broken = _shared(broken, state.broken)
            until, latest = self._ends(state, now, broken)
        shown = broken if latest <= now - self.high else broken | (until > now - self.high)
        if state is not None and (shown := _shared(shown, state.shown)) is state.shown:
            result = state.result
        else:
            result = self._result(shown)
        return Ends(now, until, broken, latest, shown, result), result

    def _ends(self, state: Ends, now: int, broken: Any) -> tuple[Any, int]:
        """When what ends a run was last there, by the state before and what is so now."""
        if now - state.then > REACH:
            until = np.where(state.broken, state.then + REACH, state.until)
            until[0] = now
            return until, now
        if broken is not state.broken:
            over = state.broken & ~broken
            if np.count_nonzero(over):
                return np.where(over, now, state.until), now
        return state.until, state.latest

    def _result(self, broken: Any) -> Any:
        low, high = (-np.inf, np.inf) if self.kind == "always" else (np.inf, -np.inf)
        result = np.where(broken, low, high)
        return result if self.kind == "always" else result[::-1]

    @property
    def kept(self) -> int:
        """See `Operator`."""
        return 4

    def rows(self, state: Ends, now: int, pick: Pick) -> Ends:
        """See `Operator`."""
        until = pick(state.until, (state.then + REACH, LONG_AGO))
        broken = pick(state.broken, (True, False))
        latest = int(until.max(initial=LONG_AGO))
        return Ends(state.then, until, broken, latest, broken, self._result(broken))


def _shared(new: Any, old: Any) -> Any:
    """The old one of two arrays that are the same, so that whoever kept it need not keep both."""
    return old if new.shape == old.shape and new.tobytes() == old.tobytes() else new


class SoFarState(NamedTuple):
    """Time of the last sample, and the fold of all samples."""

    then: int
    value: Any


@dataclass(frozen=True)
class SoFar:
    """`always`, `once` and `since` over all that was watched.

    Attributes:
        algebra: Of the intervals.
        kind: 'always', 'once' or 'since'.
    """

    algebra: Algebra = field(repr=False)
    kind: str

    def step(self, state: SoFarState | None, now: int, *values: Any) -> tuple[SoFarState, Any]:
        """See `Operator`."""
        unknown = self.algebra.constant(UNKNOWN)
        before = self.algebra.constant(self._empty()) if state is None else state.value
        if state is not None and now - state.then > REACH:
            before = self._join(before, (unknown,) * len(values))
        value = self._join(before, values)
        return SoFarState(now, value), value

    def _empty(self) -> Interval:
        return TRUE if self.kind == "always" else FALSE

    def _join(self, before: Any, values: tuple[Any, ...]) -> Any:
        least, most = self.algebra.least, self.algebra.most
        if self.kind == "since":
            return most(values[1], least(before, values[0]))
        return (least if self.kind == "always" else most)(before, values[0])

    @property
    def kept(self) -> int:
        """See `Operator`."""
        return 1

    def rows(self, state: SoFarState, now: int, pick: Pick) -> SoFarState:
        """See `Operator`."""
        then, value = state
        if now - then > REACH:
            # The silence is not part of what was watched of those that are new.
            unknown = self.algebra.constant(UNKNOWN)
            then, value = now - REACH, self._join(value, (unknown, unknown))
        return SoFarState(then, pick(value, self._empty()))


MAYBE: Interval = (0.0, 1.0)


class Tally(NamedTuple):
    """How much has been counted.

    Attributes:
        then: Time of the last sample.
        clock: What counts: microseconds, or samples.
        born: The clock at the first sample.
        total: (surely, possibly) true up to the clock.
        rate: How `total` grows with the clock from here on.
        begin: (clock, (total, rate)) at the piece in which the window begins.
        queue: The same of all pieces after it.
    """

    then: int
    clock: int
    born: int
    total: Any
    rate: Any
    begin: tuple[int, tuple[Any, Any]]
    queue: Queue


@dataclass(frozen=True)
class Counting:
    """`f in 60 % of 2 s`, `f in 3 of 5 samples`: how much above the least it was true.

    Attributes:
        algebra: Of the intervals.
        least: Share of the time, or number of samples.
        span: Length of the window, microseconds, or number of samples.
        samples: Whether samples are counted.
    """

    algebra: Algebra = field(repr=False)
    least: float
    span: int
    samples: bool

    def step(self, state: Tally | None, now: int, *values: Any) -> tuple[Tally, Any]:
        """See `Operator`."""
        a = self.algebra
        maybe, held = a.constant(MAYBE), a.held(values[0])
        if state is None:
            clock, none = 0 if self.samples else now, a.constant((0.0, 0.0))
            state = Tally(now, clock, clock, none, maybe, (clock, (none, maybe)), Queue())
        elif now - state.then > REACH:
            moment = state.clock + (0 if self.samples else REACH)
            state = self._added(state, state.then + REACH, moment, maybe)
        clock = state.clock if self.samples else now
        state = self._added(state, now, clock, held)
        start = state.clock - self.span
        queue, begin = state.queue.advance(start, state.begin)
        moment, (total, rate) = begin
        before = a.tallied(total, a.scaled(rate, float(start - moment)))
        counted = a.tallied(state.total, a.scaled(before, -1.0))
        # Counted in whole samples or microseconds, so that what just suffices is told exactly.
        over = a.shifted(counted, -self.least if self.samples else -round(self.least * self.span))
        share = over if self.samples else a.scaled(over, 1.0 / self.span)
        return state._replace(queue=queue, begin=begin), a.shifted(share, EQUAL)

    def _added(self, state: Tally, now: int, clock: int, held: Any) -> Tally:
        """The tally with a sample: of samples it counts at once, of time while it stands."""
        a = self.algebra
        if self.samples:
            clock, total, rate = clock + 1, a.tallied(state.total, held), a.constant((0.0, 0.0))
        else:
            passed = a.scaled(state.rate, float(clock - state.clock))
            total, rate = a.tallied(state.total, passed), held
        queue = state.queue.push(clock, (total, rate))
        return Tally(now, clock, state.born, total, rate, state.begin, queue)

    @property
    def kept(self) -> int:
        """See `Operator`."""
        return 2 * ((self.span if self.samples else most_samples(self.span)) + 2)

    def rows(self, state: Tally, now: int, pick: Pick) -> Tally:
        """See `Operator`."""

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


class Remembered(NamedTuple):
    """What was known last, and when; microseconds."""

    value: Any
    time: Any


@dataclass(frozen=True)
class Recalling:
    """`last(x, 0.5 s)`: what was known last, while it is not too old.

    Attributes:
        algebra: Of the intervals.
        age: Microseconds.
    """

    algebra: Algebra = field(repr=False)
    age: int

    def step(self, state: Remembered | None, now: int, *values: Any) -> tuple[Remembered, Any]:
        """See `Operator`."""
        a, (value,) = self.algebra, values
        unknown = a.constant(UNKNOWN)
        old = state or Remembered(unknown, LONG_AGO)
        known = a.known(value)
        kept = Remembered(a.choose(known, value, old.value), a.choose(known, now, old.time))
        return kept, a.choose(now - kept.time <= self.age, kept.value, unknown)

    @property
    def kept(self) -> int:
        """See `Operator`."""
        return 2

    def rows(self, state: Remembered, now: int, pick: Pick) -> Remembered:
        """See `Operator`."""
        return Remembered(pick(state.value, UNKNOWN), pick(state.time, LONG_AGO, lead=0))


@dataclass(frozen=True)
class Latching:
    """A comparison with two thresholds: the second one counts from when it is true to when it is false.

    Attributes:
        algebra: Of the intervals.
    """

    algebra: Algebra = field(repr=False)

    def step(self, state: Any, now: int, *values: Any) -> tuple[Any, Any]:
        """See `Operator`; the values are those by the threshold to enter and to leave."""
        entered = self.algebra.constant(FALSE)[0] > 0 if state is None else state
        enter, leave = values
        result = self.algebra.choose(entered, leave, enter)
        low, high = result
        return (low > 0) | (entered & (high >= 0)), result

    @property
    def kept(self) -> int:
        """See `Operator`."""
        return 1

    def rows(self, state: Any, now: int, pick: Pick) -> Any:
        """See `Operator`."""
        return pick(state, False, lead=0)

"""A monitor of one formula over plain signals, from any source.

It executes the operations of a compiled program one by one on single intervals. They are defined in
`_interval_jit` and `operators`, shared with the loops over all bindings of objects.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from visup.rules.formula.nodes import Formula
from visup.rules.formula.units import TICKS
from visup.rules.monitoring import _interval_jit as on_intervals
from visup.rules.monitoring.compiler import Compiler, Operation
from visup.rules.monitoring.early import EarlyCompiler
from visup.rules.monitoring.intervals import (
    FALSE,
    TRUE,
    UNKNOWN,
    AtEnd,
    Interval,
    Scalars,
    as_ended,
)
from visup.rules.monitoring.operators import (
    BooleanWindow,
    HysteresisLatch,
    SampleAndHold,
    SlidingWindow,
    TemporalOperator,
    Unbounded,
    ValueWhenTrue,
)
from visup.rules.monitoring.samples import LONG_AGO, SAMPLE_HOLD, Update
from visup.rules.monitoring.signals import Signals, known_interval, later
from visup.rules.monitoring.sliding import Queue

Run = Callable[[list[Interval], tuple[Any, ...], list[Any], int, Signals], Interval]
"""(values of the operations before, states before, states after, microseconds, signals) -> value."""

_ON = Scalars()
_OPEN, _FORESEEN = -2, -1
"""Indices, after the states of operators, of the samples without a verdict yet, and of the early verdict."""


class Monitor:
    """Evaluates a formula at every sample of some signals, at a cost independent of its windows.

    >>> from visup.rules.language.parser import parse_formula
    >>> from visup.rules.predicates.vocabulary import signals
    >>> monitor = Monitor(parse_formula("x() > 1 for 0.2 s", signals("x")))
    >>> [monitor.step(t, {"x": x}) for t, x in ((0.0, 3.0), (0.1, 4.0), (0.2, 2.0), (0.3, 0.0))]
    [(-inf, 2.0), (-inf, 2.0), (1.0, 1.0), (-1.0, -1.0)]

    With `early`, `foreseen` returns what is decided before a window of the future is over:

    >>> monitor = Monitor(parse_formula("eventually[60 s] x() > 1", signals("x")), early=True)
    >>> _ = monitor.step(0.0, {"x": 3.0})  # of a minute ago
    >>> monitor.foreseen(), monitor.early_delay, monitor.delay
    ((2.0, inf), 0.0, 60.0)

    Args:
        formula: Its quantities are the signals, written `name()`.
        early: Whether to compute early verdicts at every sample, which up to doubles the cost.

    Attributes:
        delay: Delay of verdicts, seconds: the result at t is about t - delay.
        early_delay: The same for early verdicts.
        state: The complete state, immutable: microseconds of the last sample, or None before the first,
            and the states of the operators. Restore an older one to continue from it.
    """

    def __init__(self, formula: Formula, *, early: bool = False) -> None:
        compiler = Compiler()
        value = compiler.formula(formula)
        first = EarlyCompiler(compiler).formula(formula).first if early else value
        self._runs = [_run(step, k) for k, step in enumerate(compiler.program.steps)]
        self._at = value.step
        self.delay = value.delay / TICKS
        self._early_at, self.early_delay = first.step, first.delay / TICKS
        self._wait = value.delay
        states = (None,) * len(self._runs)
        self.state: tuple[int | None, tuple[Any, ...]] = (None, (*states, Queue(), UNKNOWN))

    def step(self, time: float, values: Signals) -> Interval:
        """Process one sample.

        Args:
            time: Seconds, later than all before.
            values: Number or interval of each signal; None, NaN or left out when unknown.

        Returns:
            The robustness interval of the formula; see `verdict`.

        Raises:
            SettingsError: The time is not a number, or not later than the previous one; a signal is a
                reversed interval.
        """
        then, before = self.state
        now = later(time, then)
        after: list[Any] = [*before]
        found: list[Interval] = []
        take = found.append
        for run in self._runs:
            take(run(found, before, after, now, values))
        if self._wait:
            after[_OPEN] = after[_OPEN].advance(now - self._wait, None)[0].push(now, None)
        after[_FORESEEN] = found[self._early_at]
        self.state = now, tuple(after)
        return found[self._at]

    def foreseen(self) -> Interval:
        """The early verdict at the last sample, about the moment `early_delay` before it.

        The interval that `step` returns in the end, `delay` after that moment, lies within this one: what
        is true or false here stays so. Without `early` it is the same as the result of `step`.
        """
        foreseen: Interval = self.state[1][_FORESEEN]
        return foreseen

    def finish(self, at_end: AtEnd = "unknown") -> list[tuple[float, Interval]]:
        """The pending verdicts if there were no more samples; can be called at any time.

        Args:
            at_end: Treatment of undecided verdicts.

        Returns:
            Seconds of each sample without a verdict so far, and its robustness interval.
        """
        kept, verdicts = self.state, list[tuple[float, Interval]]()
        for moment in kept[1][_OPEN].times():
            found = self.step((moment + self._wait) / TICKS, {})
            verdicts.append((moment / TICKS, as_ended(found, at_end)))
        self.state = kept
        return verdicts


def _run(step: Operation, slot: int) -> Run:
    """The executor of one operation of a program."""
    one, other = (*step.reads, -1, -1)[:2]
    first, second = (*step.numbers, 0.0, 0.0)[:2]
    if step.operator is not None:
        return _operator_run(_update(step.operator), slot, one, other)
    if step.node is not None:
        name = step.node.name
        return _lookup_run(name)
    if step.kind == "number":
        return lambda v, before, after, now, signals: (first, second)
    function = _FUNCTIONS[step.kind]
    if len(step.reads) == 2:
        return lambda v, before, after, now, signals: function(v[one], v[other], first)
    return lambda v, before, after, now, signals: function(v[one], first, second)


def _lookup_run(name: str) -> Run:
    """An executor that looks up a signal; with a fast path for floats."""

    def lookup(v: Any, before: Any, after: Any, now: int, signals: Signals) -> Interval:
        value = signals.get(name)
        if type(value) is float and value == value:  # NaN is not equal to itself
            return (value, value)
        return known_interval(value)

    return lookup


def _operator_run(update: Update, slot: int, one: int, other: int) -> Run:
    """An executor that reads and writes its state in a slot."""

    def single(v: Any, before: Any, after: Any, now: int, signals: Signals) -> Any:
        after[slot], value = update(before[slot], now, v[one])
        return value

    def pair(v: Any, before: Any, after: Any, now: int, signals: Signals) -> Any:
        after[slot], value = update(before[slot], now, v[one], v[other])
        return value

    return single if other < 0 else pair


def _plain(function: Any) -> Callable[..., Any]:
    """The Python function that was compiled."""
    plain: Callable[..., Any] = function.py_func
    return plain


_FUNCTIONS: Mapping[str, Callable[..., Interval]] = {
    "not": _plain(on_intervals.mirrored),
    "above": _plain(on_intervals.shifted),
    "below": _plain(on_intervals.mirrored),
    "abs": _plain(on_intervals.absolute),
    "least": lambda v, w, _: _ON.least(v, w),
    "most": lambda v, w, _: _ON.most(v, w),
    "compare": _plain(on_intervals.compared),
    "+": _plain(on_intervals.added),
    "-": _plain(on_intervals.subtracted),
    "*": _plain(on_intervals.product),
    "/": on_intervals.quotient,
    "rate": _plain(on_intervals.rate),
    "sqrt": _plain(on_intervals.rooted),
    "exp": _plain(on_intervals.exponential),
    "power": on_intervals.powered,
}
"""Stateless operations: (interval, two numbers) or (two intervals, a number)."""


def _update(operator: TemporalOperator) -> Update:
    """The update function of an operator for single intervals."""
    match operator:
        case Unbounded(kind=kind):
            return _unbounded(kind)
        case SampleAndHold(age=age):
            recalled = _plain(on_intervals.recalled)

            def hold(state: Any, now: int, v: Interval) -> tuple[Any, Interval]:
                kept, at = state or (UNKNOWN, LONG_AGO)
                value, kept, at = recalled(v, kept, at, now, age)
                return (kept, at), value

            return hold
        case HysteresisLatch():
            latched = _plain(on_intervals.latched)

            def latch(
                state: Any, now: int, enter: Interval, leave: Interval
            ) -> tuple[Any, Interval]:
                value, entered = latched(enter, leave, bool(state))
                return entered, value

            return latch
        case ValueWhenTrue():

            def note(state: Any, now: int, v: Interval, at: Interval) -> tuple[Any, Interval]:
                kept = v if at[0] > 0 else state or UNKNOWN
                return kept, kept

            return note
        case BooleanWindow(kind=kind, high=high):
            return SlidingWindow(kind, 0, high).on(_ON)
    return operator.on(_ON)


def _unbounded(kind: str) -> Update:
    least, most = _ON.least, _ON.most
    fold = least if kind == "always" else most
    empty = TRUE if kind == "always" else FALSE

    def single(before: Interval, v: Interval) -> Interval:
        return fold(before, v)

    def since(before: Interval, left: Interval, right: Interval) -> Interval:
        return most(right, least(before, left))

    join: Callable[..., Interval] = since if kind == "since" else single

    def step(state: Any, now: int, *values: Interval) -> tuple[Any, Interval]:
        then, before = state or (now, empty)
        if now - then > SAMPLE_HOLD:
            before = join(before, *(UNKNOWN,) * len(values))
        value = join(before, *values)
        return (now, value), value

    return step

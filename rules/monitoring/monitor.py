"""One formula over plain numbers: for signals that belong to no object, from any source."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from math import isnan
from typing import Any

from visup.agent import Truth
from visup.rules.formula.nodes import Formula
from visup.rules.formula.units import TICKS, ticks
from visup.rules.monitoring.compiler import Compiler, Operation
from visup.rules.monitoring.intervals import UNKNOWN, Interval, Scalars

Signals = Mapping[str, float | Interval | None]
Run = Callable[[list[Interval], tuple[Any, ...], list[Any], int, Signals], Interval]
"""(values of the steps before, states before, states after, microseconds, signals) -> value."""

_ON = Scalars()


class Monitor:
    """Judges a formula at every sample of some signals, at the same cost whatever its windows.

    >>> from visup.rules.language.parser import parse_formula
    >>> from visup.rules.predicates.vocabulary import signals
    >>> monitor = Monitor(parse_formula("x() > 1 for 0.2 s", signals("x")))
    >>> [monitor.step(t, {"x": x}) for t, x in ((0.0, 3.0), (0.1, 4.0), (0.2, 2.0), (0.3, 0.0))]
    [(-inf, 2.0), (-inf, 2.0), (1.0, 1.0), (-1.0, -1.0)]

    Args:
        formula: Its quantities are the signals, written `name()`.

    Attributes:
        delay: How many seconds late a verdict comes: what is told at t is about t - delay.
        state: All that is remembered, an immutable value; put back an older one to go on from it.
    """

    def __init__(self, formula: Formula) -> None:
        compiler = Compiler()
        place = compiler.formula(formula)
        self._runs = [_run(step, k) for k, step in enumerate(compiler.program.steps)]
        self._at = place.step
        self.delay = place.delay / TICKS
        self.state: tuple[Any, ...] = (None,) * len(self._runs)

    def step(self, time: float, values: Signals) -> Interval:
        """Take in one sample.

        Args:
            time: Seconds, later than all before.
            values: Number or interval of each signal; None, NaN or left out when unknown.

        Returns:
            The robustness interval of the formula; see `verdict`.
        """
        now, before = ticks(time), self.state
        after, found = list(before), list[Interval]()
        for run in self._runs:
            found.append(run(found, before, after, now, values))
        self.state = tuple(after)
        return found[self._at]


def verdict(interval: Interval) -> Truth:
    """True when all of the interval lies above 0, false when all lies below, else unknown."""
    low, high = interval
    if low > 0:
        return Truth.TRUE
    return Truth.FALSE if high < 0 else Truth.UNKNOWN


def _run(step: Operation, slot: int) -> Run:
    """How one step of a program is done."""
    one, other = (*step.reads, -1, -1)[:2]
    if step.operator is not None:
        stepped = step.operator.on(_ON)
        if len(step.reads) == 1:

            def single(v: Any, before: Any, after: Any, now: int, signals: Signals) -> Any:
                after[slot], value = stepped(before[slot], now, v[one])
                return value

            return single

        def several(v: Any, before: Any, after: Any, now: int, signals: Signals) -> Any:
            after[slot], value = stepped(before[slot], now, v[one], v[other])
            return value

        return several
    if step.node is not None:
        name = step.node.name
        return lambda v, before, after, now, signals: _known(signals.get(name))
    if step.kind == "number":
        number = step.numbers[0], step.numbers[0]
        return lambda v, before, after, now, signals: number
    function = _function(step)
    if len(step.reads) == 2:
        return lambda v, before, after, now, signals: function(v[one], v[other])
    return lambda v, before, after, now, signals: function(v[one])


def _known(value: float | Interval | None) -> Interval:
    """What a signal says."""
    if value.__class__ is float:
        return UNKNOWN if isnan(value) else (value, value)
    if value is None:
        return UNKNOWN
    return value if isinstance(value, tuple) else (float(value), float(value))


def _function(step: Operation) -> Callable[..., Interval]:
    """What a step does to the intervals of one moment."""
    a, numbers = _ON, (*step.numbers, 0.0, 0.0)
    first, second = numbers[:2]
    functions: dict[str, Callable[..., Interval]] = {
        "not": a.negated,
        "abs": a.absolute,
        "least": a.least,
        "most": a.most,
        "above": lambda v: (v[0] + first + second, v[1] + first + second),
        "below": lambda v: (-v[1] + first + second, -v[0] + first + second),
        "compare": lambda v, w: a.shifted(a.added(v, a.negated(w)), first),
        "+": a.added,
        "-": lambda v, w: a.added(v, a.negated(w)),
        "*": a.times,
        "/": a.over,
        "rate": lambda v, w: a.scaled(a.added(v, a.negated(w)), first),
    }
    return functions[step.kind]

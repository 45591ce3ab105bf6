"""One formula over plain numbers: for signals that belong to no object, from any source."""

from __future__ import annotations

from collections.abc import Mapping
from math import isnan
from typing import Any

from visup.agent import Truth
from visup.rules.formula import Formula, Predicate
from visup.rules.intervals import UNKNOWN, Interval, Scalars
from visup.rules.program import Compiler, Moment
from visup.rules.terms import Measure
from visup.rules.units import TICKS, ticks


class Monitor:
    """Judges a formula at every sample of some signals, at the same cost whatever its windows.

    >>> from visup.rules.language import parse_formula
    >>> from visup.rules.vocabulary import signals
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
        compiler = Compiler(Scalars())
        place = compiler.formula(formula)
        self._program, self._at = compiler.program, place.step
        self.delay = place.delay / TICKS
        self.state: tuple[Any, ...] = self._program.fresh

    def step(self, time: float, values: Mapping[str, float | Interval | None]) -> Interval:
        """Take in one sample.

        Args:
            time: Seconds, later than all before.
            values: Number or interval of each signal; None, NaN or left out when unknown.

        Returns:
            The robustness interval of the formula; see `verdict`.
        """

        def look(node: Predicate | Measure, axes: tuple[int, ...]) -> Interval:
            value = values.get(node.name)
            if value.__class__ is float:
                return UNKNOWN if isnan(value) else (value, value)
            if value is None:
                return UNKNOWN
            return value if isinstance(value, tuple) else (float(value), float(value))

        moment = Moment(ticks(time), self.state, look)
        result: Interval = self._program.step(moment)[self._at]
        self.state = tuple(moment.after)
        return result


def verdict(interval: Interval) -> Truth:
    """True when all of the interval lies above 0, false when all lies below, else unknown."""
    low, high = interval
    if low > 0:
        return Truth.TRUE
    return Truth.FALSE if high < 0 else Truth.UNKNOWN

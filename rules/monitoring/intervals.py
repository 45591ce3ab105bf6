"""Robustness intervals [low, high]: bounds of a quantity, or of a formula's distance from changing.

There are two algebras: single intervals (`Scalars`), and arrays of them for all bindings of objects at once
(`Arrays`). The window operators are written once for both.
 A formula's robustness is how far its quantities are from changing its truth (Donze and Maler, "Robust
satisfaction of temporal logic over real-valued signals", 2010); an interval also expresses what is unknown
(Deshmukh and others, "Robust online monitoring of signal temporal logic", 2017). A formula is true when all
of its interval is above 0, false when all of it is below, else unknown. A Boolean fact has infinite
robustness, an unknown one [-inf, inf]. For equal quantities `>=` and `<=` hold and `>` and `<` do not:
`EQUAL` is added or subtracted, which changes no other number.
"""

from __future__ import annotations

from math import inf
from typing import Any, Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from visup.agent import Truth

Interval = tuple[float, float]
IntervalArray = NDArray[np.float64]
"""(2, ...) array: lower bounds, upper bounds."""

UNKNOWN: Interval = (-inf, inf)
FALSE: Interval = (-inf, -inf)
TRUE: Interval = (inf, inf)
EQUAL = 1e-300


def verdict(interval: Interval) -> Truth:
    """True if the whole interval is above 0, false if it is below, else unknown."""
    low, high = interval
    if low > 0:
        return Truth.TRUE
    return Truth.FALSE if high < 0 else Truth.UNKNOWN


AtEnd = Literal["unknown", "weak", "strong"]
"""Undecided verdicts at the end of a recording: unknown, the best possible, or the worst possible."""


def as_ended(interval: Interval, view: AtEnd) -> Interval:
    """The final value of an interval at the end of a recording.

    In the weak view undecided is true, in the strong view false (Eisner and others,
    "Reasoning with temporal logic on truncated paths", 2003).
    """
    low, high = interval
    return interval if view == "unknown" else (high, high) if view == "weak" else (low, low)


class Algebra(Protocol):
    """The operations that window operators need; `v` and `w` are intervals of one kind."""

    def constant(self, value: Interval) -> Any:
        """An interval that is the same for all bindings of objects."""

    def least(self, v: Any, w: Any) -> Any:
        """The minimum of each bound: 'and'."""

    def most(self, v: Any, w: Any) -> Any:
        """The maximum of each bound: 'or'."""

    def held(self, v: Any) -> Any:
        """(certainly, possibly) true, each 0 or 1."""

    def scaled(self, v: Any, factor: float) -> Any:
        """Multiply by a nonnegative number; also for results of `held`."""

    def tallied(self, v: Any, w: Any) -> Any:
        """The sum of results of `held`, which are finite."""

    def shifted(self, v: Any, by: float) -> Any:
        """Add a number to both bounds."""


class Scalars:
    """Single intervals, as pairs of floats."""

    def constant(self, value: Interval) -> Interval:
        """See `Algebra`."""
        return value

    def least(self, v: Interval, w: Interval) -> Interval:
        """See `Algebra`."""
        a, b = v
        c, d = w
        # Returns an operand itself where possible, so that windows share values.
        if a <= c and b <= d:
            return v
        return w if c <= a and d <= b else (a if a < c else c, b if b < d else d)

    def most(self, v: Interval, w: Interval) -> Interval:
        """See `Algebra`."""
        a, b = v
        c, d = w
        if a >= c and b >= d:
            return v
        return w if c >= a and d >= b else (a if a > c else c, b if b > d else d)

    def held(self, v: Interval) -> Interval:
        """See `Algebra`."""
        return (1.0 if v[0] > 0 else 0.0, 1.0 if v[1] >= 0 else 0.0)

    def scaled(self, v: Interval, factor: float) -> Interval:
        """See `Algebra`."""
        return (v[0] * factor, v[1] * factor)

    def tallied(self, v: Interval, w: Interval) -> Interval:
        """See `Algebra`."""
        return (v[0] + w[0], v[1] + w[1])

    def shifted(self, v: Interval, by: float) -> Interval:
        """See `Algebra`."""
        return (v[0] + by, v[1] + by)


class Arrays:
    """(2, cells) arrays of intervals, one for each binding of objects."""

    def constant(self, value: Interval) -> IntervalArray:
        """See `Algebra`."""
        return np.array(value).reshape(2, 1)

    # NumPy's functions directly, since a wrapper would double the cost.
    least: Any = staticmethod(np.minimum)
    most: Any = staticmethod(np.maximum)
    scaled: Any = staticmethod(np.multiply)
    shifted: Any = staticmethod(np.add)
    tallied: Any = staticmethod(np.add)

    def held(self, v: IntervalArray) -> IntervalArray:
        """See `Algebra`."""
        return np.array((v[0] > 0, v[1] >= 0), dtype=np.float64)

"""Intervals [low, high]: what is known of a quantity, and of how far a formula is from changing.

One algebra of two kinds: of single intervals (`Scalars`), and of arrays of them for all choices of
objects at once (`Arrays`). The operators that keep windows are written once for both.

A formula's robustness is how far its quantities are from where it changes its truth (Donze and
Maler, "Robust satisfaction of temporal logic over real-valued signals", 2010); as an interval it
also says how little is known (Deshmukh and others, "Robust online monitoring of signal temporal
logic", 2017). It is true when all of it lies above 0, false when all of it lies below, else
unknown. A fact, which is no matter of degree, has an infinite one, and what is not known at all has
[-inf, inf]. Where two quantities are equal, `>=` and `<=` hold and `>` and `<` do not: `EQUAL` is
added or subtracted, which changes no other number.
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
    """True when all of the interval lies above 0, false when all lies below, else unknown."""
    low, high = interval
    if low > 0:
        return Truth.TRUE
    return Truth.FALSE if high < 0 else Truth.UNKNOWN


AtEnd = Literal["unknown", "weak", "strong"]
"""What is undecided when a recording ends: still unknown, the best that could come, or the worst."""


def as_ended(interval: Interval, view: AtEnd) -> Interval:
    """The value of an interval that nothing will narrow any further.

    In the weak view what is undecided is true, in the strong view it is false (Eisner and others,
    "Reasoning with temporal logic on truncated paths", 2003).
    """
    low, high = interval
    return interval if view == "unknown" else (high, high) if view == "weak" else (low, low)


class Algebra(Protocol):
    """What operators with windows ask of intervals; `v` and `w` are intervals of its kind."""

    def constant(self, value: Interval) -> Any:
        """An interval that is the same for all choices of objects."""

    def least(self, v: Any, w: Any) -> Any:
        """The lesser of each bound: 'and'."""

    def most(self, v: Any, w: Any) -> Any:
        """The greater of each bound: 'or'."""

    def held(self, v: Any) -> Any:
        """(surely, possibly) true, each 0 or 1."""

    def scaled(self, v: Any, factor: float) -> Any:
        """Times a number that is not negative; also of what `held` gives."""

    def tallied(self, v: Any, w: Any) -> Any:
        """The sum of what `held` gives, which is never without end."""

    def shifted(self, v: Any, by: float) -> Any:
        """A number added to both bounds."""


class Scalars:
    """Single intervals, as pairs of floats."""

    def constant(self, value: Interval) -> Interval:
        """See `Algebra`."""
        return value

    def least(self, v: Interval, w: Interval) -> Interval:
        """See `Algebra`."""
        a, b = v
        c, d = w
        # One of the two where it can be: a window then holds each value once.
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
    """(2, cells) arrays of intervals, one for each choice of objects."""

    def constant(self, value: Interval) -> IntervalArray:
        """See `Algebra`."""
        return np.array(value).reshape(2, 1)

    # NumPy's functions themselves, since a call costs as much as what they do.
    least: Any = staticmethod(np.minimum)
    most: Any = staticmethod(np.maximum)
    scaled: Any = staticmethod(np.multiply)
    shifted: Any = staticmethod(np.add)
    tallied: Any = staticmethod(np.add)

    def held(self, v: IntervalArray) -> IntervalArray:
        """See `Algebra`."""
        return np.array((v[0] > 0, v[1] >= 0), dtype=np.float64)

"""The meaning of formulas in dense time over signals that are held, cell by cell.

All samples and all ends of windows lie on a grid, so that every formula is constant in its cells and
the words of `docs/rules.md` can be taken cell by cell. No code is shared with `visup.rules`.
"""

from __future__ import annotations

from functools import reduce
from math import inf

from tests.oracles.rule_oracle import robustness
from visup.rules.formula.nodes import (
    And,
    Comparison,
    Formula,
    FutureOperator,
    Literal,
    Not,
    Or,
    PastOperator,
    Since,
    TimeWindow,
    Until,
)
from visup.rules.formula.units import Number

Interval = tuple[float, float]
CELL_MS = 40
ANYTHING: Interval = (-inf, inf)
TRUE: Interval = (inf, inf)
FALSE: Interval = (-inf, -inf)


class DenseOracle:
    """Values of formulas in the cells of a recording.

    Args:
        signals: Of each signal its value in every cell.
        cut: Whether there is nothing outside the recording; else what is there is not known.
    """

    def __init__(self, signals: dict[str, list[Interval]], cut: bool) -> None:
        self.signals, self.cut = signals, cut
        self.count = len(next(iter(signals.values())))

    def cells(self, formula: Formula) -> list[Interval]:
        """The value in every cell of the recording."""
        return [self.at(formula, k) for k in range(self.count)]

    def there(self, low: int, high: int) -> range:
        """The cells of a window that count."""
        return (
            range(max(low, 0), min(high, self.count - 1) + 1) if self.cut else range(low, high + 1)
        )

    def at(self, f: Formula, k: int) -> Interval:
        match f:
            case Literal(value=value):
                return TRUE if value else FALSE
            case Comparison():
                if not 0 <= k < self.count:
                    return robustness(f, [(0, {})])[0]
                return robustness(f, [(0, {n: v[k] for n, v in self.signals.items()})])[0]
            case Not(part=part):
                low, high = self.at(part, k)
                return -high, -low
            case And(parts=parts):
                return _least([self.at(p, k) for p in parts])
            case Or(parts=parts):
                return _most([self.at(p, k) for p in parts])
            case PastOperator(kind=kind, part=part, window=window):
                if window is None:
                    if k < 0:
                        return ANYTHING
                    low, high = 0, k
                else:
                    low, high = k - _cells(window.high), k - _cells(window.low)
                values = [self.at(part, j) for j in self.there(low, high)]
                return _least(values) if kind == "always" else _most(values)
            case FutureOperator(kind=kind, part=part, window=TimeWindow(low=a, high=b)):
                values = [self.at(part, j) for j in self.there(k + _cells(a), k + _cells(b))]
                return _most(values) if kind == "eventually" else _least(values)
            case Since(left=left, right=right, window=window):
                return self.since(left, right, window, k)
            case Until(left=left, right=right, window=TimeWindow(low=a, high=b)):
                return self.until(left, right, _cells(a), _cells(b), k)
        raise TypeError(f"not in dense time: {f}")

    def since(self, f: Formula, g: Formula, window: TimeWindow | None, k: int) -> Interval:
        if window is None:
            if k < 0:
                return ANYTHING
            low, high = 0, 0
            begin = 0
        else:
            low, high = _cells(window.low), _cells(window.high)
            begin = k - high
        found = []
        for j in self.there(begin, k - low):
            # At this very moment g suffices; of an earlier cell the rest must be f, too.
            between = [self.at(f, i) for i in range(j, k + 1)] if j < k else []
            found.append(_least([self.at(g, j), *between]))
        return _most(found)

    def until(self, f: Formula, g: Formula, low: int, high: int, k: int) -> Interval:
        found = []
        for j in self.there(k + low, k + high):
            # In the first cell of a later window one is somewhere in its inner.
            last = j if low and j == k + low else j - 1
            before = [self.at(f, i) for i in range(k, last + 1)]
            found.append(_least([self.at(g, j), *before]))
        return _most(found)


def _cells(n: Number) -> int:
    return round(n.base * 1000 / CELL_MS)


def _least(values: list[Interval]) -> Interval:
    return reduce(lambda v, w: (min(v[0], w[0]), min(v[1], w[1])), values, TRUE)


def _most(values: list[Interval]) -> Interval:
    return reduce(lambda v, w: (max(v[0], w[0]), max(v[1], w[1])), values, FALSE)

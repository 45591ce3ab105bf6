"""Piecewise linear signals: exact moments at which a comparison changes.

A quantity is a sequence of straight lines, each a pair of its end values; sums, differences and multiples of
lines are lines. A comparison of lines is Boolean.
"""

from __future__ import annotations

from collections.abc import Sequence

from visup.agent.model.errors import RuleError
from visup.rules.dense_time.sweep import Aligned, Piece, append
from visup.rules.monitoring.intervals import FALSE, TRUE, UNKNOWN, Interval

Line = tuple[float, float]
"""Values of a quantity at the start and end of a piece; NaN for unknown."""


def combined(operator: str, v: Line, w: Line) -> Line:
    """A sum, a difference, or a product or quotient with a constant."""
    if operator == "+":
        return v[0] + w[0], v[1] + w[1]
    if operator == "-":
        return v[0] - w[0], v[1] - w[1]
    if operator == "*":
        return v[0] * w[0], v[1] * w[1]
    return (v[0] / w[0], v[1] / w[1]) if w[0] else (float("nan"),) * 2


def refused(what: object) -> RuleError:
    """The error that something is not a straight line."""
    return RuleError(
        f"'{what}' is not straight where signals are",
        expected="sums, differences and multiples of signals",
        hint="judge it over signals that are held: reading='held'",
    )


class LineComparison:
    """A comparison of two lines.

    Args:
        operator: `<`, `<=`, `>`, `>=`, `==` or `!=`.
    """

    def __init__(self, operator: str) -> None:
        self._operator, self._aligned = operator, Aligned(2)

    def take(self, rows: Sequence[list[Piece]]) -> list[Piece]:
        """See `operators.Operator`."""
        found: list[Piece] = []
        for begin, end, (v, w) in self._aligned.take(rows):
            difference = (v[0] - w[0], v[1] - w[1])
            for part in self._parts(begin, end, difference):
                append(found, part)
        return found

    def finish(self, end: float) -> list[Piece]:
        """See `operators.Operator`."""
        return []

    def _parts(self, begin: float, end: float, line: Line) -> list[Piece]:
        first, last = line
        if first != first or last != last:  # NaN is not equal to itself
            return [Piece(begin, end, UNKNOWN)]
        if first * last >= 0.0:
            return [Piece(begin, end, self._truth(first + last))]
        crossing = begin + round((end - begin) * first / (first - last))
        parts = Piece(begin, crossing, self._truth(first)), Piece(crossing, end, self._truth(last))
        return [p for p in parts if p.begin < p.end]

    def _truth(self, difference: float) -> Interval:
        """The truth inside an interval without a change of sign."""
        if difference == 0.0:
            return TRUE if "=" in self._operator and self._operator != "!=" else FALSE
        holds = {"<": difference < 0, ">": difference > 0, "=": False, "!": True}
        return TRUE if holds[self._operator[0]] else FALSE

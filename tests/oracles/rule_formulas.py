"""Random formulas over two signals, and random histories with gaps, for comparing evaluators."""

from __future__ import annotations

from math import inf, nan
from random import Random
from typing import Any

import numpy as np

from visup.rules.formula.nodes import (
    ZERO,
    And,
    Comparison,
    Formula,
    FutureOperator,
    Last,
    Let,
    Literal,
    MOfN,
    Not,
    Or,
    PastOperator,
    Previous,
    Since,
    TimeWindow,
    Until,
    walk,
)
from visup.rules.formula.terms import (
    Arithmetic,
    Measure,
    Negative,
    PointwiseFunction,
    Term,
    Variable,
    WindowFunction,
)
from visup.rules.formula.units import Number, Unit

Interval = tuple[float, float]
SIGNALS = ("x", "y")
STEP_MS = 40


def random_formula(rng: Random, depth: int, words: tuple[str, ...] = ()) -> Formula:
    """A formula drawn from all operators.

    Args:
        rng: Source of chance.
        depth: How many operators may stand one within another.
        words: Arguments of the signals; none for signals that belong to no object.

    Returns:
        A formula over `SIGNALS`.
    """
    if depth == 0 or rng.random() < 0.1:
        return _comparison(rng, words)

    def part() -> Formula:
        return random_formula(rng, depth - 1, words)

    # What depends on no object has no first sample of its own.
    match rng.randrange(15 if words else 16):
        case 14:
            return _let(rng, depth, words)
        case 13:
            return Previous(part())
        case 15:
            return rng.choice((Literal(True), Literal(False)))
        case 0:
            return Not(part())
        case 1:
            return And(tuple(part() for _ in range(rng.randint(2, 3))))
        case 2:
            return Or((part(), part()))
        case 3 | 4:
            return PastOperator(rng.choice(("always", "once")), part(), _window(rng, 0.3))
        case 5:
            return PastOperator(rng.choice(("always", "once")), part())
        case 6 | 7:
            return Since(part(), part(), rng.choice((None, _window(rng, 0.4))))
        case 8:
            kind = rng.choice(("eventually", "henceforth"))
            return FutureOperator(kind, part(), _window(rng, 0.5))
        case 9:
            return Until(part(), part(), _window(rng, 0.4))
        case 10:
            of = rng.randint(1, 6)
            return MOfN(part(), Number(float(rng.randint(1, of))), Number(float(of)))
        case 11:
            share = Number(float(rng.choice((10, 25, 50, 60, 80, 100))), Unit.PERCENT)
            return MOfN(part(), share, _span(rng))
    return Last(part(), _span(rng))


def _let(rng: Random, depth: int, words: tuple[str, ...]) -> Let:
    """A value noted when something of now or of the past is true, and compared in a formula."""
    at = random_formula(rng, depth - 1, words)
    while any(isinstance(n, FutureOperator | Until) for n in walk(at)):
        at = random_formula(rng, depth - 1, words)
    name = f"v{rng.randrange(10**6)}"
    noted = Variable(name, random_term(rng, rng.randint(0, 1), words), at)
    assert noted.part is not None
    compared = Comparison(random_term(rng, 1, words), rng.choice("<>"), noted)
    part = random_formula(rng, depth - 1, words)
    joined: Formula = rng.choice((compared, And((compared, part)), Or((part, compared))))
    if rng.random() < 0.3:
        joined = PastOperator(rng.choice(("always", "once")), joined, _window(rng, 0.3))
    return Let(name, noted.part, at, joined)


def _comparison(rng: Random, words: tuple[str, ...]) -> Comparison:
    operator = rng.choice(("<", "<=", ">", ">=", "==", "!="))
    bound = Number(rng.randint(-8, 8) / 4)
    leave = None
    if rng.random() < 0.25 and operator[0] in "<>":
        slack = rng.randint(0, 6) / 4 * (-1 if ">" in operator else 1)
        leave = Number(bound.value + slack)
    return Comparison(random_term(rng, rng.randint(0, 2), words), operator, bound, leave)


def random_term(rng: Random, depth: int, words: tuple[str, ...] = ()) -> Term:
    """A quantity drawn from all functions; the units of what it adds do not matter."""
    if depth == 0:
        return Measure(rng.choice(SIGNALS), words)

    def part() -> Term:
        return random_term(rng, depth - 1, words)

    match rng.randrange(9):
        case 7:
            return PointwiseFunction(rng.choice(("sqrt", "exp")), (part(),))
        case 8:
            return PointwiseFunction("power", (part(), Number(float(rng.randint(0, 3)))))
        case 0 | 1:
            return Arithmetic(part(), rng.choice("+-*/"), part())
        case 2:
            return Arithmetic(part(), rng.choice("+-*/"), Number(rng.choice((0.5, 2.0, 3.0))))
        case 3:
            return Negative(part())
        case 4:
            return PointwiseFunction("abs", (part(),))
        case 5:
            return PointwiseFunction(rng.choice(("min", "max")), (part(), part()))
    name = rng.choice(("rate", "before", "lowest", "highest", "last"))
    return WindowFunction(name, part(), _span(rng))


def _span(rng: Random) -> Number:
    """A time that often ends just where a sample stands."""
    steps = rng.choice((1, 2, 3, 5, 8, 13, 25, 40))
    return Number(float(steps * STEP_MS + rng.choice((0, 0, 0, 7))), Unit.MS)


def _window(rng: Random, later: float) -> TimeWindow:
    high = _span(rng)
    if rng.random() >= later:
        return TimeWindow(ZERO, high)
    return TimeWindow(Number(high.value * rng.choice((0.25, 0.5, 1.0)), Unit.MS), high)


def random_times(rng: Random, count: int) -> list[float]:
    """Moments in seconds: mostly even, with jitter and with silences longer than a sample speaks."""
    now, times = rng.randint(0, 3) * 0.1, []
    for _ in range(count):
        times.append(round(now, 6))
        step = STEP_MS * rng.choice((1, 1, 1, 1, 2, 5)) + rng.choice((0, 0, 0, 3))
        if rng.random() < 0.1:
            step = rng.choice((500, 501, 700, 1600))
        now += step / 1000
    return times


def random_value(rng: Random) -> Interval:
    """A number, an interval, something unknown or something without end."""
    if rng.random() < 0.15:
        return (-inf, inf)
    if rng.random() < 0.03:
        return (inf, inf)
    value = rng.randint(-10, 10) / 4
    return (value, value if rng.random() < 0.8 else value + rng.randint(0, 4) / 4)


NUMBERS = (float, np.float64, np.float32, np.float16, np.array)
NOTHING = (None, nan, np.float64(nan), np.float32(nan), (nan, nan), (-inf, np.float64(nan)))


def as_given(rng: Random, value: Interval) -> Any:
    """A value as users have it: numbers of Python or NumPy, one for what is certain, NaN or None for unknown.

    All that `random_value` draws is exact in each of these.
    """
    low, high = value
    if value == (-inf, inf) and rng.random() < 0.8:
        return rng.choice(NOTHING)
    if low == high and rng.random() < 0.7:
        whole = low.is_integer() and rng.random() < 0.5
        return rng.choice((int, np.int64, np.int8))(low) if whole else rng.choice(NUMBERS)(low)
    return rng.choice(NUMBERS)(low), rng.choice(NUMBERS)(high)

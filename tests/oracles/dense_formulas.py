"""Random formulas and recordings for dense time: all samples and windows on a grid of cells."""

from __future__ import annotations

from random import Random

from tests.oracles.dense_oracle import CELL_MS
from tests.oracles.rule_formulas import SIGNALS, Interval, random_value
from visup.rules.formula.nodes import (
    ZERO,
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
from visup.rules.formula.terms import Measure
from visup.rules.formula.units import Number, Unit


def dense_formula(rng: Random, depth: int) -> Formula:
    """A formula drawn from all operators that have a value between samples."""
    if depth == 0 or rng.random() < 0.1:
        bound = Number(rng.randint(-8, 8) / 4)
        return Comparison(
            Measure(rng.choice(SIGNALS)), rng.choice(("<", "<=", ">", ">=", "==")), bound
        )

    def part() -> Formula:
        return dense_formula(rng, depth - 1)

    match rng.randrange(9):
        case 0:
            return Not(part())
        case 1:
            return And((part(), part()))
        case 2:
            return Or((part(), part()))
        case 3 | 4:
            window = rng.choice((None, _window(rng), _window(rng)))
            return PastOperator(rng.choice(("always", "once")), part(), window)
        case 5:
            return FutureOperator(rng.choice(("eventually", "henceforth")), part(), _window(rng))
        case 6:
            return Since(part(), part(), rng.choice((None, _window(rng))))
        case 7:
            return Until(part(), part(), _window(rng))
    return Literal(rng.random() < 0.5)


def _window(rng: Random) -> TimeWindow:
    high = rng.randint(1, 6)
    low = rng.randint(0, high) if rng.random() < 0.5 else 0
    begin = Number(float(low * CELL_MS), Unit.MS) if low else ZERO
    return TimeWindow(begin, Number(float(high * CELL_MS), Unit.MS))


def random_recording(rng: Random, cells: int) -> list[tuple[int, dict[str, Interval]]]:
    """Samples at irregular cells: the cell of each and its values; the last is the last cell."""
    chosen = sorted({0, cells - 1, *(k for k in range(cells) if rng.random() < 0.4)})
    return [(k, {n: random_value(rng) for n in SIGNALS}) for k in chosen]


def held(samples: list[tuple[int, dict[str, Interval]]]) -> dict[str, list[Interval]]:
    """The value of each signal in every cell, up to that of the last sample."""
    found: dict[str, list[Interval]] = {n: [] for n in samples[0][1]}
    ends = [k for k, _ in samples[1:]] + [samples[-1][0] + 1]
    for (begin, values), end in zip(samples, ends, strict=True):
        for name, value in values.items():
            found[name] += [value] * (end - begin)
    return found

"""Formulas for rtamt, to be compared with where all samples are present and regular.

Source: Nickovic and Yamaguchi, "RTAMT: online robustness monitors from STL", 2020.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from random import Random
from typing import Any

from visup.rules.formula.nodes import (
    ZERO,
    And,
    Comparison,
    Formula,
    FutureOperator,
    Not,
    Or,
    PastOperator,
    Since,
    TimeWindow,
    Until,
)
from visup.rules.formula.terms import Arithmetic, Measure, PointwiseFunction, Term
from visup.rules.formula.units import Number, Unit

STEP_MS = 40
"""From sample to sample; rtamt counts samples."""


def available() -> bool:
    """Whether rtamt is installed."""
    try:
        import rtamt  # noqa: F401
    except ImportError:
        return False
    return True


def online(
    formula: Formula, names: tuple[str, ...]
) -> Callable[[int, list[tuple[str, float]]], Any]:
    """Rtamt's online monitor of a formula.

    Args:
        formula: One that `written` can write.
        names: Its signals.

    Returns:
        Takes the number of a sample and the values by name, gives the robustness.
    """
    import rtamt

    monitor = _declared(rtamt.StlDiscreteTimeSpecification(), formula, names)
    update: Callable[[int, list[tuple[str, float]]], Any] = monitor.update
    return update


def offline(formula: Formula, samples: Mapping[str, list[float]]) -> list[float]:
    """Rtamt's robustness of a formula at every sample, with all samples at hand.

    Its online monitors of formulas about the future differ from this one, so that only those of
    formulas about the past are compared with.
    """
    import rtamt

    monitor = _declared(rtamt.StlDiscreteTimeSpecification(), formula, tuple(samples))
    count = len(next(iter(samples.values())))
    told = monitor.evaluate({"time": list(range(count)), **samples})
    return [float(value) for _, value in told]


def _declared(monitor: Any, formula: Formula, names: tuple[str, ...]) -> Any:
    for name in (*names, "out"):
        monitor.declare_var(name, "float")
    monitor.spec = f"out = {written(formula)}"
    monitor.parse()
    return monitor


def written(node: Formula | Term) -> str:
    """A formula in rtamt's syntax, its windows counted in samples.

    Raises:
        TypeError: rtamt has nothing like it.
    """
    match node:
        case Number(value=value):
            return f"{value:g}"
        case Measure(name=name):
            return name
        case Arithmetic(left=left, operator=operator, right=right):
            return f"({written(left)} {operator} {written(right)})"
        case PointwiseFunction(name="abs", parts=(part,)):
            return f"abs({written(part)})"
        case Comparison(left=left, operator=operator, right=right):
            return f"({written(left)} {operator} {written(right)})"
        case Not(part=part):
            return f"not({written(part)})"
        case And(parts=parts) | Or(parts=parts):
            word = " and " if isinstance(node, And) else " or "
            return f"({word.join(written(p) for p in parts)})"
        case PastOperator(kind=kind, part=part, window=window):
            word = "historically" if kind == "always" else "once"
            return f"{word}{_counted(window)}({written(part)})"
        case FutureOperator(kind=kind, part=part, window=window):
            word = "eventually" if kind == "eventually" else "always"
            return f"{word}{_counted(window)}({written(part)})"
        case Since(left=left, right=right, window=window):
            return f"({written(left)} since{_counted(window)} {written(right)})"
        case Until(left=left, right=right, window=window):
            return f"({written(left)} until{_counted(window)} {written(right)})"
    raise TypeError(f"rtamt has nothing like {node}")


def _counted(window: TimeWindow | None) -> str:
    if window is None:
        return ""
    low, high = (round(n.base * 1000 / STEP_MS) for n in (window.low, window.high))
    return f"[{low}:{high}]"


def shared_formula(rng: Random, depth: int) -> Formula:
    """A random formula that both can say; what looks back without end looks at no windows."""
    if depth == 0 or rng.random() < 0.1:
        return _comparison(rng)

    def part() -> Formula:
        return shared_formula(rng, depth - 1)

    match rng.randrange(9):
        case 0:
            return Not(part())
        case 1:
            return And((part(), part()))
        case 2:
            return Or((part(), part()))
        case 3 | 4:
            return PastOperator(rng.choice(("always", "once")), part(), _window(rng, 0.3))
        case 5:
            return PastOperator(rng.choice(("always", "once")), _comparison(rng))
        case 6:
            return Since(_comparison(rng), _comparison(rng))
        case 7:
            return Since(part(), part(), _window(rng, 0.0))
    if rng.random() < 0.5:
        return Until(part(), part(), _window(rng, 0.0))
    return FutureOperator(rng.choice(("eventually", "henceforth")), part(), _window(rng, 0.5))


def horizon(node: Formula | Term) -> int:
    """How many samples before the moment that is spoken of a formula looks at."""
    match node:
        case PastOperator(part=part, window=window):
            return _samples(window) + horizon(part)
        case Since(left=left, right=right, window=window):
            return _samples(window) + max(horizon(left), horizon(right))
        case Until(left=left, right=right):
            return max(horizon(left), horizon(right))
        case And(parts=parts) | Or(parts=parts):
            return max(map(horizon, parts))
        case Not(part=part) | FutureOperator(part=part):
            return horizon(part)
    return 0


def _samples(window: TimeWindow | None) -> int:
    return 0 if window is None else round(window.high.base * 1000 / STEP_MS)


def _comparison(rng: Random) -> Comparison:
    x, y = Measure("x"), Measure("y")
    term: Term = rng.choice(
        (x, y, Arithmetic(x, "+", y), Arithmetic(x, "-", y), PointwiseFunction("abs", (y,)))
    )
    # Numbers of two kinds, so that nothing is equal and the conventions for that do not matter.
    return Comparison(
        term, rng.choice(("<", "<=", ">", ">=")), Number(rng.randint(-4, 4) / 2 + 0.25)
    )


def _window(rng: Random, later: float) -> TimeWindow:
    high = rng.choice((1, 2, 3, 5, 8))
    low = rng.randint(1, high) if rng.random() < later else 0
    if low == high:
        low = 0
    begin = ZERO if low == 0 else Number(float(low * STEP_MS), Unit.MS)
    return TimeWindow(begin, Number(float(high * STEP_MS), Unit.MS))

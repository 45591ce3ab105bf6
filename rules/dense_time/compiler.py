"""Compiler from formulas to operators over pieces, with common subexpressions shared."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import reduce
from math import inf

from visup.agent.model.errors import RuleError
from visup.rules.dense_time.lines import LineComparison, combined, refused
from visup.rules.dense_time.operators import (
    Latch,
    Operator,
    PieceHold,
    PieceNote,
    Pointwise,
    PreviousPiece,
    SinceWindow,
    SoFar,
    UntilWindow,
    Window,
    least,
    most,
)
from visup.rules.formula.nodes import (
    And,
    Comparison,
    Formula,
    FutureOperator,
    Last,
    Let,
    Literal,
    Node,
    Not,
    Or,
    PastOperator,
    Previous,
    Since,
    TimeWindow,
    Until,
    children,
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
from visup.rules.formula.units import Number, ticks
from visup.rules.monitoring import _interval_jit as on_intervals
from visup.rules.monitoring.intervals import EQUAL, FALSE, TRUE, Interval

Function = Callable[..., Interval]


@dataclass
class PieceProgram:
    """Operators in order, each reading those before it.

    Attributes:
        constants: Value of each constant, by step.
        signals: Name of each signal, by step.
        steps: Operator and operands, by step; None for constants and signals.
    """

    constants: dict[int, object] = field(default_factory=dict)
    signals: dict[int, str] = field(default_factory=dict)
    steps: list[tuple[Operator, tuple[int, ...]] | None] = field(default_factory=list)


class PieceCompiler:
    """Compiles a formula into a program.

    Args:
        reading: 'samples', 'held' or 'linear'.
    """

    def __init__(self, reading: str) -> None:
        self.program = PieceProgram()
        self._samples, self._linear = reading == "samples", reading == "linear"
        self._places: dict[object, int] = {}

    def formula(self, node: Formula) -> int:
        """Compile a formula.

        Raises:
            RuleError: It has no exact value for this reading of signals.
        """
        place = self._places.get(node)
        if place is None:
            place = self._places[node] = self._formula(node)
        return place

    def _formula(self, node: Formula) -> int:
        match node:
            case Literal(value=value):
                return self._constant(TRUE if value else FALSE)
            case Comparison():
                return self._comparison(node)
            case Not(part=part):
                return self._map(_negated, self.formula(part))
            case And(parts=parts) | Or(parts=parts):
                join = least if isinstance(node, And) else most
                return reduce(lambda a, b: self._map(join, a, b), map(self.formula, parts))
            case PastOperator(kind=kind, part=part, window=None):
                return self._so_far(Window(kind, -inf, 0.0, self._samples), self.formula(part))
            case PastOperator(kind=kind, part=part, window=TimeWindow() as window):
                low, high = _bounds(window)
                return self._window(kind, -high, -low, self.formula(part))
            case FutureOperator(kind=kind, part=part, window=TimeWindow() as window):
                past = "once" if kind == "eventually" else "always"
                return self._window(past, *_bounds(window), self.formula(part))
            case Since(left=left, right=right, window=None):
                sides = self.formula(left), self.formula(right)
                return self._so_far(SinceWindow(0, inf, self._samples), *sides)
            case Since(left=left, right=right, window=TimeWindow() as window):
                sides = self.formula(left), self.formula(right)
                return self._step(SinceWindow(*_bounds(window), self._samples), *sides)
            case Until(left=left, right=right, window=TimeWindow() as window):
                sides = self.formula(left), self.formula(right)
                return self._step(UntilWindow(*_bounds(window), self._samples), *sides)
            case Last(part=part, duration=age):
                return self._step(PieceHold(ticks(age.base)), self.formula(part))
            case Let(part=part):
                return self.formula(part)
            case Previous(part=part) if self._samples:
                return self._step(PreviousPiece(), self.formula(part))
        raise RuleError(
            f"'{node}' has no value between samples",
            expected="windows of time, and operators of the moment",
            hint="judge it over samples: reading='samples', or Monitor",
        )

    def term(self, node: Term) -> int:
        """Compile a quantity."""
        place = self._places.get(node)
        if place is None:
            made = self._line(node) if self._linear else self._term(node)
            place = self._places[node] = made
        return place

    def _term(self, node: Term) -> int:
        match node:
            case Number():
                return self._constant((node.base, node.base))
            case Measure(name=name):
                return self._signal(name)
            case Negative(part=part):
                return self._map(_negated, self.term(part))
            case Arithmetic(left=left, operator=operator, right=right):
                return self._map(_ARITHMETIC[operator], self.term(left), self.term(right))
            case PointwiseFunction(name="min" | "max" as name, parts=parts):
                join = least if name == "min" else most
                return reduce(lambda a, b: self._map(join, a, b), map(self.term, parts))
            case PointwiseFunction(name=name, parts=parts):
                return self._map(_FUNCTIONS[name], *map(self.term, parts))
            case Variable(part=part, at=at) if part is not None:
                return self._step(PieceNote(), self.term(part), self.formula(at))
            case WindowFunction():
                return self._over_time(node)
        raise AssertionError(f"no quantity: {node}")

    def _over_time(self, node: WindowFunction) -> int:
        span, part = ticks(node.duration.base), self.term(node.part)
        match node.name:
            case "last":
                return self._step(PieceHold(span), part)
            case "before":
                return self._window("always", -span, -span, part)
            case "lowest" | "highest":
                kind = "always" if node.name == "lowest" else "once"
                return self._window(kind, -span, 0, part)
        begin, factor = self._window("always", -span, -span, part), 1.0 / node.duration.base
        return self._map(lambda v, w: on_intervals.rate.py_func(v, w, factor), part, begin)  # type: ignore[attr-defined]

    def _line(self, node: Term) -> int:
        match node:
            case Number():
                return self._constant((node.base, node.base))
            case Measure(name=name):
                return self._signal(name)
            case Negative(part=part):
                return self._map(lambda v: (-v[0], -v[1]), self.term(part))
            case Arithmetic(left=left, operator=operator, right=right):
                straight = operator in "+-" or isinstance(right, Number)
                if straight or (operator == "*" and isinstance(left, Number)):
                    sides = self.term(left), self.term(right)
                    return self._map(lambda v, w: combined(operator, v, w), *sides)
        raise refused(node)

    def _comparison(self, node: Comparison) -> int:
        entered = self._compared(node.operator, node.left, node.right)
        if node.leave is None:
            return entered
        return self._step(Latch(), entered, self._compared(node.operator, node.left, node.leave))

    def _compared(self, operator: str, left: Term, right: Term) -> int:
        sides = self.term(left), self.term(right)
        if self._linear:
            return self._step(LineComparison(operator), *sides)
        return self._map(_COMPARISONS[operator], *sides)

    def _window(self, kind: str, low: float, high: float, part: int) -> int:
        return self._step(Window(kind, low, high, self._samples), part)

    def _so_far(self, inner: Window | SinceWindow, *parts: int) -> int:
        return self._step(SoFar(inner), *parts)

    def _map(self, function: Callable[..., object], *parts: int) -> int:
        return self._step(Pointwise(len(parts), function), *parts)

    def _step(self, operator: Operator, *parts: int) -> int:
        self.program.steps.append((operator, parts))
        return len(self.program.steps) - 1

    def _constant(self, value: object) -> int:
        self.program.steps.append(None)
        place = len(self.program.steps) - 1
        self.program.constants[place] = value
        return place

    def _signal(self, name: str) -> int:
        self.program.steps.append(None)
        place = len(self.program.steps) - 1
        self.program.signals[place] = name
        return place


def horizon(node: Node) -> float:
    """Future horizon of a formula, microseconds."""
    match node:
        case FutureOperator(part=part, window=TimeWindow() as window):
            return _bounds(window)[1] + horizon(part)
        case Until(left=left, right=right, window=TimeWindow() as window):
            return _bounds(window)[1] + max(horizon(left), horizon(right))
    return max((horizon(c) for c in children(node)), default=0.0)


def _bounds(window: TimeWindow) -> tuple[int, int]:
    return ticks(window.low.base), ticks(window.high.base)


def _negated(v: Interval) -> Interval:
    return (-v[1], -v[0])


def _equal(v: Interval, w: Interval) -> Interval:
    low, high = _ABSOLUTE(_MINUS(v, w, 0.0), 0.0, 0.0)
    return (EQUAL - high, EQUAL - low)


def _unequal(v: Interval, w: Interval) -> Interval:
    low, high = _ABSOLUTE(_MINUS(v, w, 0.0), 0.0, 0.0)
    return (low - EQUAL, high - EQUAL)


def _plain(function: object) -> Function:
    """The uncompiled Python function, which is faster for two floats."""
    plain: Function = function.py_func  # type: ignore[attr-defined]
    return plain


_COMPARED, _MINUS = _plain(on_intervals.compared), _plain(on_intervals.subtracted)
_ABSOLUTE = _plain(on_intervals.absolute)
_PLUS, _TIMES = _plain(on_intervals.added), _plain(on_intervals.product)
_COMPARISONS: Mapping[str, Function] = {
    ">": lambda v, w: _COMPARED(v, w, -EQUAL),
    ">=": lambda v, w: _COMPARED(v, w, EQUAL),
    "<": lambda v, w: _COMPARED(w, v, -EQUAL),
    "<=": lambda v, w: _COMPARED(w, v, EQUAL),
    "==": _equal,
    "!=": _unequal,
}
_ARITHMETIC: Mapping[str, Function] = {
    "+": lambda v, w: _PLUS(v, w, 0.0),
    "-": lambda v, w: _MINUS(v, w, 0.0),
    "*": lambda v, w: _TIMES(v, w, 0.0),
    "/": lambda v, w: on_intervals.quotient(v, w, 0.0),
}
_FUNCTIONS: Mapping[str, Function] = {
    "abs": lambda v: _ABSOLUTE(v, 0.0, 0.0),
    "sqrt": lambda v: on_intervals.rooted(v, 0.0, 0.0),
    "exp": lambda v: on_intervals.exponential(v, 0.0, 0.0),
    "power": lambda v, w: on_intervals.powered(v, w, 0.0),
}

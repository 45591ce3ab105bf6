"""Compiler from formulas to one program of steps with common subexpressions shared.

Every formula becomes a step that reads the results of earlier steps. Equal formulas of the same variables, in
one rule or several, are one step. An object variable is an axis of the arrays, so that one step serves all
bindings of objects. A program is only a description: `monitor` executes it on single intervals, `vm` on those
of all bindings.
 Future operators are turned into past ones by delay (pastification, Maler and Nickovic): `eventually[5 s] f`
is reported 5 s late as `f within 5 s`, and its siblings are delayed as long.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable
from dataclasses import dataclass, field
from math import inf

from visup.rules.formula.nodes import (
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
    Predicate,
    Previous,
    Quantified,
    Rule,
    Since,
    TimeWindow,
    Until,
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
from visup.rules.monitoring.further_operators import (
    BegunWindow,
    DelayedUnbounded,
    EndedWindow,
    PreviousSample,
)
from visup.rules.monitoring.intervals import EQUAL
from visup.rules.monitoring.operators import (
    BooleanWindow,
    HysteresisLatch,
    SampleAndHold,
    SlidingCount,
    SlidingWindow,
    TemporalOperator,
    Unbounded,
    ValueWhenTrue,
)

Scope = tuple[tuple[str, bool], ...]
"""The variables of a formula by axis, each with whether it may repeat another."""


def scope_of(rule: Rule) -> Scope:
    """The variables of a rule by axis."""
    return tuple((v, v in rule.may_repeat) for v in rule.variables)


def inner_scope(node: Quantified, scope: Scope) -> Scope:
    """The variables of a quantifier's operand."""
    return (*scope, (node.variable, node.may_repeat))


@dataclass(frozen=True, slots=True)
class Operation:
    """One step of a program.

    Attributes:
        kind: 'number', 'look', 'remember', 'exists' or 'forall'; or a pointwise operation: 'not', 'abs',
            'least', 'most', 'above', 'below', 'compare', '+', '-', '*', '/', 'rate'.
        reads: Steps whose values it reads.
        axes: Axes of the objects that its value depends on.
        numbers: For 'number' its interval; for 'above' and 'below' the offset, then the tie-breaker; for
            'compare' the latter; for 'rate' the factor.
        node: For 'look' the node to look up.
        order: For 'look' the axes in the order of its arguments; for a quantifier its axis, then the
            axes whose objects it excludes.
        operator: For 'remember' the operator.
    """

    kind: str
    reads: tuple[int, ...] = ()
    axes: frozenset[int] = frozenset()
    numbers: tuple[float, ...] = ()
    node: Predicate | Measure | None = None
    order: tuple[int, ...] = ()
    operator: TemporalOperator | None = None


@dataclass(frozen=True, slots=True)
class ValueRef:
    """A reference to the value of a formula.

    Attributes:
        step: Its step.
        delay: Its delay, microseconds.
        axes: Axes of the objects that it depends on.
        certain: Whether it is Boolean: its robustness is always infinite.
    """

    step: int
    delay: int = 0
    axes: frozenset[int] = frozenset()
    certain: bool = False


@dataclass
class Program:
    """Steps in order, each reading those before it.

    Attributes:
        steps: The steps.
        places: Key of equal steps -> number of the step.
    """

    steps: list[Operation] = field(default_factory=list)
    places: dict[Hashable, int] = field(default_factory=dict)

    def add(self, key: Hashable, step: Operation) -> int:
        """The step with this key, added if new."""
        if key not in self.places:
            self.steps.append(step)
            self.places[key] = len(self.steps) - 1
        return self.places[key]

    def lookups(self) -> Iterable[tuple[int, Predicate | Measure]]:
        """All lookups, each with its step."""
        return ((k, s.node) for k, s in enumerate(self.steps) if s.node is not None)

    def operators(self) -> Iterable[TemporalOperator]:
        """All temporal operators."""
        return (s.operator for s in self.steps if s.operator is not None)


class Compiler:
    """Compiles formulas into a program."""

    def __init__(self) -> None:
        self.program = Program()

    def rule(self, rule: Rule) -> tuple[ValueRef, ...]:
        """Compile `when` and `unless`, with equal delay."""
        scope = scope_of(rule)
        return tuple(self.together([self.formula(f, scope) for f in rule.formulas]))

    def formula(self, node: Formula, scope: Scope = ()) -> ValueRef:
        """Compile a formula."""
        match node:
            case Predicate():
                return self._lookup(node, scope, certain=True)
            case Literal(value=value):
                number = inf if value else -inf
                return self.constant(number, number, certain=True)
            case Comparison():
                return self._comparison(node, scope)
            case Not(part=part):
                return self.combined("not", self.formula(part, scope))
            case And(parts=parts) | Or(parts=parts):
                join = "least" if isinstance(node, And) else "most"
                return self._combined_all(join, [self.formula(p, scope) for p in parts])
            case PastOperator(kind=kind, part=part, window=window):
                return self._past(kind, window, self.formula(part, scope))
            case Previous(part=part):
                at = self.formula(part, scope)
                return self.remembered(PreviousSample(), at, certain=at.certain)
            case Since(left=left, right=right, window=window):
                sides = self.together([self.formula(left, scope), self.formula(right, scope)])
                return self._since(window, *sides)
            case FutureOperator(kind=kind, part=part, window=window):
                assert window is not None
                past = "once" if kind == "eventually" else "always"
                low, high = ticks(window.low.base), ticks(window.high.base)
                return self.windowed(past, 0, high - low, high, self.formula(part, scope))
            case Until(left=left, right=right, window=window):
                return self._until(window, self.formula(left, scope), self.formula(right, scope))
            case MOfN(part=part, least=least, of=of):
                span = round(of.base) if node.counts_samples else ticks(of.base)
                counting = SlidingCount(least.base, span, node.counts_samples)
                return self.remembered(counting, self.formula(part, scope))
            case Last(part=part, duration=age):
                return self._sample_and_hold(age, self.formula(part, scope))
            case Quantified():
                return self._quantified(node, scope)
            case Let(part=part):
                return self.formula(part, scope)

    def term(self, node: Term, scope: Scope = ()) -> ValueRef:
        """Compile a quantity."""
        match node:
            case Number():
                return self.constant(node.base, node.base)
            case Measure():
                return self._lookup(node, scope, certain=False)
            case Negative(part=part):
                return self.combined("not", self.term(part, scope))
            case Arithmetic(left=left, operator=operator, right=right):
                return self.combined(operator, self.term(left, scope), self.term(right, scope))
            case PointwiseFunction(name="abs" | "sqrt" | "exp" as name, parts=(part,)):
                return self.combined(name, self.term(part, scope))
            case PointwiseFunction(name="power", parts=(base, exponent)):
                return self.combined("power", self.term(base, scope), self.term(exponent, scope))
            case PointwiseFunction(name=name, parts=parts):
                join = "least" if name == "min" else "most"
                return self._combined_all(join, [self.term(p, scope) for p in parts])
            case Variable(part=part, at=at):
                assert part is not None
                noted = self.term(part, scope), self.formula(at, scope)
                return self.remembered(ValueWhenTrue(), *noted)
            case WindowFunction():
                return self._over_time(node, self.term(node.part, scope))

    def constant(self, low: float, high: float, certain: bool = False) -> ValueRef:
        """A constant step."""
        step = Operation("number", numbers=(low, high))
        return ValueRef(self.program.add(("number", low, high), step), certain=certain)

    def combined(self, kind: str, *at: ValueRef, numbers: tuple[float, ...] = ()) -> ValueRef:
        """A stateless step."""
        axes, reads = _axes(at), tuple(p.step for p in at)
        step = self.program.add((kind, numbers, reads), Operation(kind, reads, axes, numbers))
        return ValueRef(step, at[0].delay, axes, all(p.certain for p in at))

    def _combined_all(self, join: str, parts: list[ValueRef]) -> ValueRef:
        together = self.together(parts)
        at = together[0]
        for part in together[1:]:
            at = self.combined(join, at, part)
        return at

    def together(self, parts: list[ValueRef]) -> list[ValueRef]:
        """The same values, delayed to the latest one."""
        latest = max(p.delay for p in parts)
        return [self.waited(p, latest - p.delay) for p in parts]

    def waited(self, at: ValueRef, wait: int) -> ValueRef:
        """The same value, delayed further."""
        return self.windowed("always", wait, wait, wait, at) if wait else at

    def remembered(
        self, operator: TemporalOperator, *at: ValueRef, delay: int = 0, certain: bool = False
    ) -> ValueRef:
        """A step with a temporal operator."""
        axes, reads = _axes(at), tuple(p.step for p in at)
        step = Operation("remember", reads, axes, operator=operator)
        return ValueRef(
            self.program.add((operator, reads), step), at[0].delay + delay, axes, certain
        )

    def windowed(self, kind: str, low: int, high: int, delay: int, *at: ValueRef) -> ValueRef:
        """The minimum ('always') or maximum ('once') over a window of the past, or 'since' or 'until' in it.

        Args:
            kind: Kind of operator.
            low: How long before now the window ends, microseconds.
            high: How long before now it begins.
            delay: Additional delay of the value relative to the operands.
            at: The operands.
        """
        certain = all(p.certain for p in at)
        lasting = certain and low == 0 and kind in ("always", "once")
        operator: TemporalOperator = (
            BooleanWindow(kind, high) if lasting else SlidingWindow(kind, low, high)
        )
        return self.remembered(operator, *at, delay=delay, certain=certain)

    def _past(self, kind: str, window: TimeWindow | None, at: ValueRef) -> ValueRef:
        if window is not None:
            return self.windowed(kind, ticks(window.low.base), ticks(window.high.base), 0, at)
        return self.unbounded(kind, at)

    def unbounded(self, kind: str, *at: ValueRef) -> ValueRef:
        """'always', 'once' or 'since' over the whole past."""
        delay = at[0].delay
        operator = DelayedUnbounded(kind, delay) if delay else Unbounded(kind)
        return self.remembered(operator, *at, certain=all(p.certain for p in at))

    def _since(self, window: TimeWindow | None, left: ValueRef, right: ValueRef) -> ValueRef:
        if window is None:
            return self.unbounded("since", left, right)
        low, high = ticks(window.low.base), ticks(window.high.base)
        found = self.windowed("since", low, high, 0, left, right)
        if not low:
            return found
        # The left side must also have held after the window.
        return self.combined("least", found, self.remembered(BegunWindow(low), left))

    def _until(self, window: TimeWindow | None, left: ValueRef, right: ValueRef) -> ValueRef:
        assert window is not None
        left, right = self.together([left, right])
        low, high = ticks(window.low.base), ticks(window.high.base)
        found = self.windowed("until", 0, high - low, high, left, right)
        if not low:
            return found
        before = self.remembered(EndedWindow(high - low, high), left, delay=high)
        return self.combined("least", found, before)

    def _sample_and_hold(self, age: Number, at: ValueRef) -> ValueRef:
        return self.remembered(SampleAndHold(ticks(age.base)), at, certain=at.certain)

    def _comparison(self, node: Comparison, scope: Scope) -> ValueRef:
        entered = self._order(node.operator, node.left, node.right, scope)
        if node.leave is None:
            return entered
        left = self._order(node.operator, node.left, node.leave, scope)
        return self.remembered(HysteresisLatch(), entered, left)

    def _order(self, operator: str, left: Term, right: Term, scope: Scope) -> ValueRef:
        if operator in ("==", "!="):
            apart = self.combined("abs", self.combined("-", *self._sides(left, right, scope)))
            if operator == "==":
                return self.combined("below", apart, numbers=(0.0, EQUAL))
            return self.combined("above", apart, numbers=(0.0, -EQUAL))
        by = EQUAL if "=" in operator else -EQUAL
        more, less = (left, right) if operator[0] == ">" else (right, left)
        # With a constant on one side no NaN can arise, which saves half the work.
        if isinstance(less, Number):
            return self.combined("above", self.term(more, scope), numbers=(-less.base, by))
        if isinstance(more, Number):
            return self.combined("below", self.term(less, scope), numbers=(more.base, by))
        return self.combined("compare", *self._sides(more, less, scope), numbers=(by,))

    def _sides(self, left: Term, right: Term, scope: Scope) -> tuple[ValueRef, ValueRef]:
        return self.term(left, scope), self.term(right, scope)

    def _over_time(self, node: WindowFunction, at: ValueRef) -> ValueRef:
        span = ticks(node.duration.base)
        match node.name:
            case "last":
                return self._sample_and_hold(node.duration, at)
            case "before":
                return self.windowed("always", span, span, 0, at)
            case "lowest" | "highest":
                return self.windowed("always" if node.name == "lowest" else "once", 0, span, 0, at)
        begin = self.windowed("always", span, span, 0, at)
        return self.combined("rate", at, begin, numbers=(1.0 / node.duration.base,))

    def _lookup(self, node: Predicate | Measure, scope: Scope, certain: bool) -> ValueRef:
        names = [name for name, _ in scope]
        # An inner variable shadows an outer one of the same name.
        axis = {name: i for i, name in enumerate(names)}
        order = tuple(axis[w] for w in node.arguments if w in axis)
        words = tuple(axis.get(w, w) for w in node.arguments)
        key = ("look", type(node).__name__, node.name, words)
        step = Operation("look", axes=frozenset(order), node=node, order=order)
        return ValueRef(self.program.add(key, step), 0, frozenset(order), certain)

    def _quantified(self, node: Quantified, scope: Scope) -> ValueRef:
        return self.quantified(node, scope, self.formula(node.part, inner_scope(node, scope)))

    def quantified(self, node: Quantified, scope: Scope, at: ValueRef) -> ValueRef:
        """The minimum or maximum of an operand along the axis of a quantifier."""
        axis = len(scope)
        apart = () if node.may_repeat else tuple(i for i, (_, r) in enumerate(scope) if not r)
        axes, order = (at.axes | frozenset(apart)) - {axis}, (axis, *apart)
        step = Operation(node.kind, (at.step,), axes, order=order)
        return ValueRef(
            self.program.add((node.kind, at.step, order), step), at.delay, axes, at.certain
        )


def _axes(at: Iterable[ValueRef]) -> frozenset[int]:
    return frozenset[int]().union(*(p.axes for p in at))

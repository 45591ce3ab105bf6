"""Formulas made ready to run: one list of steps, in which what formulas share is done once.

Every formula becomes a step that reads the results of steps before it. Two formulas that say the
same of the same variables, in one rule or in several, are one step. An object variable is an axis of
the arrays, so that one step serves all choices of objects.

What speaks of the future is turned into the past by waiting (Maler and Nickovic's pastification):
`eventually[5 s] f` is told 5 s late as `f within 5 s`, and what stands beside it waits as long.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass, field
from math import inf
from typing import Any

import numpy as np

from visup.rules.formula import (
    And,
    Comparison,
    Formula,
    Future,
    Last,
    Not,
    Often,
    Or,
    Past,
    Predicate,
    Quantified,
    Rule,
    Since,
    Until,
    Window,
)
from visup.rules.intervals import EQUAL, Arrays, Scalars
from visup.rules.operators import (
    Counting,
    Lasting,
    Latching,
    Operator,
    Recalling,
    Sliding,
    SoFar,
)
from visup.rules.terms import Arithmetic, Combined, Measure, Negative, OverTime, Term
from visup.rules.units import Number, ticks

Scope = tuple[tuple[str, bool], ...]
"""The variables of a formula by axis, each with whether it may repeat another one."""


class Moment:
    """What steps read and write at one sample.

    Attributes:
        now: Microseconds.
        look: Value of a fact or quantity: (node, axes of its objects) -> interval.
        same: Whether two axes stand for one object: (axis, axis) -> array of truth.
        before: States of the operators before.
        after: States of the operators after.
    """

    __slots__ = ("after", "before", "look", "now", "same")

    def __init__(
        self,
        now: int,
        before: tuple[Any, ...],
        look: Callable[[Predicate | Measure, tuple[int, ...]], Any],
        same: Callable[[int, int], Any] | None = None,
    ) -> None:
        self.now = now
        self.before = before
        self.look = look
        self.same = same
        self.after: list[Any] = [None] * len(before)


Run = Callable[[list[Any], Moment], Any]


@dataclass(frozen=True, slots=True)
class Place:
    """Where the value of a formula is found.

    Attributes:
        step: Its step.
        delay: How late it comes, microseconds.
        axes: Axes of the objects that it depends on.
        certain: Whether it is no matter of degree: its robustness is always infinite.
    """

    step: int
    delay: int = 0
    axes: frozenset[int] = frozenset()
    certain: bool = False


@dataclass
class Program:
    """Steps in order, each reading those before it.

    Attributes:
        algebra: Of the intervals.
        runs: The steps.
        reads: For each step the two steps (or twice the one) from which alone its value follows, or
            None: it looks something up, or remembers.
        operators: What remembers, with the axes of its objects, in the order of their states.
        looks: What is looked up, each with its axes.
    """

    algebra: Any
    runs: list[Run] = field(default_factory=list)
    reads: list[tuple[int, int] | None] = field(default_factory=list)
    operators: list[tuple[Operator, frozenset[int]]] = field(default_factory=list)
    looks: list[tuple[Predicate | Measure, tuple[int, ...]]] = field(default_factory=list)
    places: dict[Hashable, int] = field(default_factory=dict)

    def step(self, moment: Moment, known: list[Any] | None = None) -> list[Any]:
        """Run all steps at one sample; the states after it are left in `moment.after`.

        Args:
            moment: The sample.
            known: Values of another sample of the same objects. What follows from the very same
                arrays as there is what it was there, and is not worked out again.
        """
        values: list[Any] = []
        put = values.append
        if known is None:
            for run in self.runs:
                put(run(values, moment))
            return values
        for run, reads, before in zip(self.runs, self.reads, known, strict=True):
            if (
                reads is not None
                and values[reads[0]] is known[reads[0]]
                and values[reads[1]] is known[reads[1]]
            ):
                put(before)
            else:
                put(run(values, moment))
        return values

    @property
    def fresh(self) -> tuple[None, ...]:
        """The states before the first sample."""
        return (None,) * len(self.operators)

    def add(
        self, key: Hashable, run: Callable[[], Run], reads: tuple[int, int] | None = None
    ) -> int:
        """The step of that key, made when there is none yet; see `reads`."""
        if key not in self.places:
            self.runs.append(run())
            self.reads.append(reads)
            self.places[key] = len(self.runs) - 1
        return self.places[key]

    def remember(self, operator: Operator, *parts: Place) -> int:
        """A step of an operator over time."""

        def run() -> Run:
            slot, sources = len(self.operators), tuple(p.step for p in parts)
            axes = frozenset[int]().union(*(p.axes for p in parts))
            self.operators.append((operator, axes))
            step, one = operator.step, sources[0]
            if len(sources) == 1:

                def single(values: list[Any], m: Moment) -> Any:
                    m.after[slot], value = step(m.before[slot], m.now, values[one])
                    return value

                return single

            def several(values: list[Any], m: Moment) -> Any:
                parts = (values[s] for s in sources)
                m.after[slot], value = step(m.before[slot], m.now, *parts)
                return value

            return several

        return self.add((repr(operator), *(p.step for p in parts)), run)


class Compiler:
    """Puts formulas into a program.

    Args:
        algebra: `Scalars()` for signals without objects, `Arrays(axes)` for objects.
    """

    def __init__(self, algebra: Scalars | Arrays) -> None:
        self.program = Program(algebra)
        self.algebra: Any = algebra

    def rule(self, rule: Rule) -> tuple[Place, ...]:
        """The places of `when` and `unless`, which come equally late."""
        scope = tuple((v, v in rule.may_repeat) for v in rule.variables)
        return tuple(self._together([self.formula(f, scope) for f in rule.formulas]))

    def formula(self, node: Formula, scope: Scope = ()) -> Place:
        """The place of a formula, after its steps have been put into the program."""
        match node:
            case Predicate():
                return self._called(node, scope, certain=True)
            case Comparison():
                return self._comparison(node, scope)
            case Not(part=part):
                at = self.formula(part, scope)
                negated = self.algebra.negated
                return self._map("not", lambda v: negated(v), at)
            case And(parts=parts) | Or(parts=parts):
                join = "least" if isinstance(node, And) else "most"
                return self._joined(join, [self.formula(p, scope) for p in parts])
            case Past(kind=kind, part=part, window=window):
                return self._past(kind, window, self.formula(part, scope))
            case Since(left=left, right=right, window=window):
                sides = self._together([self.formula(left, scope), self.formula(right, scope)])
                return self._since(window, *sides)
            case Future(kind=kind, part=part, window=window):
                assert window is not None
                past = "once" if kind == "eventually" else "always"
                low, high = ticks(window.low.base), ticks(window.high.base)
                return self._slid(past, 0, high - low, high, self.formula(part, scope))
            case Until(left=left, right=right, window=window):
                return self._until(window, self.formula(left, scope), self.formula(right, scope))
            case Often(part=part, least=least, of=of):
                span = round(of.base) if node.counts_samples else ticks(of.base)
                counting = Counting(self.algebra, least.base, span, node.counts_samples)
                return self._operator(counting, self.formula(part, scope))
            case Last(part=part, duration=age):
                return self._recalled(age, self.formula(part, scope))
            case Quantified():
                return self._quantified(node, scope)

    def term(self, node: Term, scope: Scope = ()) -> Place:
        """The place of a quantity."""
        a = self.algebra
        match node:
            case Number():
                value = a.constant((node.base, node.base))
                return Place(self.program.add(("number", node.base), lambda: lambda v, m: value))
            case Measure():
                return self._called(node, scope, certain=False)
            case Negative(part=part):
                return self._map("not", lambda v: a.negated(v), self.term(part, scope))
            case Arithmetic(left=left, operator=operator, right=right):
                return self._computed(operator, self.term(left, scope), self.term(right, scope))
            case Combined(name="abs", parts=(part,)):
                return self._map("abs", a.absolute, self.term(part, scope))
            case Combined(name=name, parts=parts):
                join = "least" if name == "min" else "most"
                return self._joined(join, [self.term(p, scope) for p in parts])
            case OverTime():
                return self._over_time(node, self.term(node.part, scope))

    def _map(self, key: Hashable, function: Callable[..., Any], *at: Place) -> Place:
        """A step that remembers nothing."""
        one, other = at[0].step, at[-1].step

        def run() -> Run:
            if len(at) == 1:
                return lambda values, m: function(values[one])
            return lambda values, m: function(values[one], values[other])

        step = self.program.add((key, *(p.step for p in at)), run, (one, other))
        axes = frozenset[int]().union(*(p.axes for p in at))
        return Place(step, at[0].delay, axes, all(p.certain for p in at))

    def _joined(self, join: str, parts: list[Place]) -> Place:
        function = getattr(self.algebra, join)
        together = self._together(parts)
        at = together[0]
        for part in together[1:]:
            at = self._map(join, function, at, part)
        return at

    def _together(self, parts: list[Place]) -> list[Place]:
        """The same parts, those that come earlier made to wait for the latest one."""
        latest = max(p.delay for p in parts)
        return [self._waited(p, latest - p.delay) for p in parts]

    def _waited(self, at: Place, wait: int) -> Place:
        return self._slid("always", wait, wait, wait, at) if wait else at

    def _operator(self, operator: Operator, *at: Place, delay: int = 0) -> Place:
        axes = frozenset[int]().union(*(p.axes for p in at))
        step = self.program.remember(operator, *at)
        return Place(step, at[0].delay + delay, axes, False)

    def _slid(self, kind: str, low: int, high: int, delay: int, *at: Place) -> Place:
        certain = all(p.certain for p in at)
        lasting = (
            certain and low == 0 and kind in ("always", "once") and isinstance(self.algebra, Arrays)
        )
        operator: Operator = (
            Lasting(self.algebra, kind, high) if lasting else Sliding(self.algebra, kind, low, high)
        )
        placed = self._operator(operator, *at, delay=delay)
        return Place(placed.step, placed.delay, placed.axes, certain)

    def _past(self, kind: str, window: Window | None, at: Place) -> Place:
        if window is not None:
            return self._slid(kind, ticks(window.low.base), ticks(window.high.base), 0, at)
        placed = self._operator(SoFar(self.algebra, kind), at)
        return Place(placed.step, placed.delay, placed.axes, at.certain)

    def _since(self, window: Window | None, left: Place, right: Place) -> Place:
        if window is None:
            placed = self._operator(SoFar(self.algebra, "since"), left, right)
            certain = left.certain and right.certain
            return Place(placed.step, placed.delay, placed.axes, certain)
        return self._slid("since", 0, ticks(window.high.base), 0, left, right)

    def _until(self, window: Window | None, left: Place, right: Place) -> Place:
        assert window is not None
        left, right = self._together([left, right])
        span = ticks(window.high.base)
        return self._slid("until", 0, span, span, left, right)

    def _recalled(self, age: Number, at: Place) -> Place:
        placed = self._operator(Recalling(self.algebra, ticks(age.base)), at)
        return Place(placed.step, placed.delay, placed.axes, at.certain)

    def _comparison(self, node: Comparison, scope: Scope) -> Place:
        entered = self._compared(node.operator, node.left, node.right, scope)
        if node.leave is None:
            return entered
        left = self._compared(node.operator, node.left, node.leave, scope)
        return self._operator(Latching(self.algebra), entered, left)

    def _compared(self, operator: str, left: Term, right: Term, scope: Scope) -> Place:
        a, by = self.algebra, EQUAL if "=" in operator else -EQUAL
        more, less = (left, right) if operator[0] == ">" else (right, left)
        # With a number on one side nothing can fail to be a number, and half the work is saved.
        if isinstance(less, Number):
            c = -less.base
            at = self.term(more, scope)
            return self._map(("above", c, by), lambda v: a.shifted(a.shifted(v, c), by), at)
        if isinstance(more, Number):
            d = more.base
            at = self.term(less, scope)
            below = ("below", d, by)
            return self._map(below, lambda v: a.shifted(a.shifted(a.negated(v), d), by), at)
        sides = self.term(more, scope), self.term(less, scope)
        key = ("compare", by)
        return self._map(key, lambda v, w: a.shifted(a.added(v, a.negated(w)), by), *sides)

    def _computed(self, operator: str, left: Place, right: Place) -> Place:
        a = self.algebra
        functions: dict[str, Callable[..., Any]] = {
            "+": a.added,
            "-": lambda v, w: a.added(v, a.negated(w)),
            "*": a.times,
            "/": a.over,
        }
        return self._map(operator, functions[operator], left, right)

    def _over_time(self, node: OverTime, at: Place) -> Place:
        a, span = self.algebra, ticks(node.duration.base)
        match node.name:
            case "last":
                return self._recalled(node.duration, at)
            case "before":
                return self._slid("always", span, span, 0, at)
            case "lowest" | "highest":
                return self._slid("always" if node.name == "lowest" else "once", 0, span, 0, at)
        begin = self._slid("always", span, span, 0, at)
        share = 1.0 / node.duration.base
        key = ("rate", span)
        return self._map(key, lambda v, w: a.scaled(a.added(v, a.negated(w)), share), at, begin)

    def _called(self, node: Predicate | Measure, scope: Scope, certain: bool) -> Place:
        names = [name for name, _ in scope]
        # An inner variable hides an outer one of its name.
        axis = {name: i for i, name in enumerate(names)}
        axes = tuple(axis[w] for w in node.words if w in axis)
        words = tuple(axis.get(w, w) for w in node.words)
        key = ("look", type(node).__name__, node.name, words)

        def run() -> Run:
            self.program.looks.append((node, axes))
            return lambda values, m: m.look(node, axes)

        return Place(self.program.add(key, run), 0, frozenset(axes), certain)

    def _quantified(self, node: Quantified, scope: Scope) -> Place:
        axis = len(scope)
        at = self.formula(node.part, (*scope, (node.variable, node.may_repeat)))
        apart = () if node.may_repeat else tuple(i for i, (_, r) in enumerate(scope) if not r)
        empty = -inf if node.kind == "exists" else inf
        reduce = (np.maximum if node.kind == "exists" else np.minimum).reduce

        def run() -> Run:
            source = at.step

            def quantify(values: list[Any], m: Moment) -> Any:
                value = values[source]
                assert m.same is not None
                for other in apart:
                    value = np.where(m.same(axis, other), empty, value)
                if not apart and axis not in at.axes:
                    value = np.where(m.same(axis, axis), value, empty)
                return reduce(value, axis=axis + 1, keepdims=True, initial=empty)

            return quantify

        step = self.program.add((node.kind, at.step, axis, apart), run, (at.step, at.step))
        axes = (at.axes | frozenset(apart)) - {axis}
        return Place(step, at.delay, axes, at.certain)

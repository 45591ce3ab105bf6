"""From Lark's tree to the AST; reports quantities used as conditions, and the reverse."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, cast

from lark import Token, Transformer, Tree
from lark import v_args as with_meta

from visup.agent import Severity
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
    Quantified,
    Rule,
    Since,
    TimeWindow,
    Until,
)
from visup.rules.formula.nodes import Predicate as Fact
from visup.rules.formula.rebuilding import bound
from visup.rules.formula.terms import (
    OVER_WINDOW,
    POINTWISE,
    Arithmetic,
    Measure,
    Negative,
    PointwiseFunction,
    Term,
    Variable,
    WindowFunction,
)
from visup.rules.formula.units import TIME, Number, Span, Unit

Fault = tuple[Span, str, str | None, str | None]
"""Location, what is wrong, what was expected, hint."""


EDGES = ("rising", "falling")
"""Functions that are true at the sample where a formula becomes true, or false."""


@dataclass(frozen=True, slots=True)
class UnresolvedCall:
    """`name(...)`, not yet resolved to a quantity or a fact."""

    name: str
    arguments: tuple[Any, ...]
    span: Span


@dataclass(frozen=True, slots=True)
class NameArgument:
    """A bare name among arguments."""

    name: str
    span: Span


class CallResolver:
    """Resolves calls by their context.

    Args:
        fault: Records an error.
    """

    def __init__(self, fault: Callable[[Fault], None]) -> None:
        self.fault = fault

    def formula(self, node: Any) -> Formula:
        """Resolve a node where a condition is expected."""
        if isinstance(node, UnresolvedCall):
            if node.name == "last":
                spanned = self._spanned(node)
                if spanned is None:
                    return Fact("", (), node.span)
                return Last(self.formula(spanned[0]), spanned[1])
            if node.name in EDGES:
                return self._edge(node)
            if node.name in (*POINTWISE, *OVER_WINDOW):
                what = f"'{node.name}' is a quantity, neither true nor false"
                self.fault((node.span, what, "a comparison", "compare it with a number"))
            return Fact(node.name, self._words(node), node.span)
        if isinstance(node, NameArgument):
            return Fact(node.name, (), node.span)
        if isinstance(node, Term):
            what = f"'{node}' is a quantity, neither true nor false"
            self.fault((_place(node), what, None, "compare it with another quantity"))
            return Fact("", (), _place(node))
        return cast("Formula", node)

    def term(self, node: Any) -> Term:
        """Resolve a node where a quantity is expected."""
        if isinstance(node, UnresolvedCall):
            if node.name in POINTWISE:
                return PointwiseFunction(
                    node.name,
                    tuple(self.term(a) for a in node.arguments),
                    node.span,
                )
            if node.name in OVER_WINDOW:
                spanned = self._spanned(node)
                if spanned is None:
                    return Number(0.0, span=node.span)
                part, duration = spanned
                return WindowFunction(node.name, self.term(part), duration, node.span)
            return Measure(node.name, self._words(node), node.span)
        if isinstance(node, NameArgument):
            return Variable(node.name, span=node.span)
        if isinstance(node, Term):
            return node
        what = f"'{node}' is true or false, not a quantity"
        self.fault((_place(node), what, "a quantity or a number", None))
        return Number(0.0, span=_place(node))

    def _edge(self, call: UnresolvedCall) -> Formula:
        """`rising(f)` and `falling(f)`, as syntactic sugar."""
        if len(call.arguments) != 1:
            what = f"'{call.name}' takes one formula"
            self.fault((call.span, what, f"such as {call.name}(touching(a, b))", None))
            return Fact("", (), call.span)
        part = self.formula(call.arguments[0])
        before, now = Previous(part, call.span), part
        if call.name == "rising":
            return And((now, Not(before, call.span)), call.span)
        return And((before, Not(now, call.span)), call.span)

    def _words(self, call: UnresolvedCall) -> tuple[str, ...]:
        for argument in call.arguments:
            if not isinstance(argument, NameArgument):
                what = f"'{call.name}' takes names, not what is in its parentheses"
                self.fault((call.span, what, f"such as {call.name}(a)", None))
                return ()
        return tuple(a.name for a in call.arguments)

    def _spanned(self, call: UnresolvedCall) -> tuple[Any, Number] | None:
        """The arguments of `rate(x, 2 s)` and the like, or None after an error."""
        parts = call.arguments
        if len(parts) == 2 and isinstance(parts[1], Number) and parts[1].dimension == TIME:
            return parts[0], parts[1]
        what = f"'{call.name}' takes something and a time"
        self.fault((call.span, what, f"such as {call.name}(speed(a), 2 s)", None))
        return None


def _place(node: Any) -> Span:
    own = getattr(node, "span", None)
    if isinstance(own, Span):
        return own
    inner = getattr(node, "part", None) or getattr(node, "left", None)
    return _place(inner if inner is not None else node.parts[0])


def _span_of(meta: Any) -> Span:
    """The span of a node of Lark's tree."""
    return Span(meta.line, meta.column, meta.end_line, meta.end_column)


def read_tree(tree: Tree[Token], file: str) -> tuple[Any, list[Fault]]:
    """Build rules, or one formula, from a parse tree.

    Args:
        tree: Parse tree of a rule file or a formula.
        file: Its name, for messages.

    Returns:
        A list of rules or a formula; and the errors found.
    """
    reading = _RuleBuilder(file)
    return reading.transform(tree), reading.faults


@with_meta(meta=True)
class _RuleBuilder(Transformer[Token, Any]):
    """Transforms Lark's tree to the AST.

    Args:
        file: Name of the file, for messages.

    Attributes:
        faults: Errors found, in source order.
    """

    def __init__(self, file: str) -> None:
        super().__init__()
        self.file = file
        self.faults: list[Fault] = []
        self.meaning = CallResolver(self.faults.append)

    def start(self, meta: Any, parts: list[Any]) -> list[Rule]:
        return parts

    def rule(self, meta: Any, parts: list[Any]) -> Rule:
        name, variables, severity, when, unless, hold, cooldown, say = parts
        variables = variables or ()
        return Rule(
            name=str(name),
            variables=tuple(v for v, _ in variables),
            severity=Severity[str(severity).upper()],
            when=when,
            say=say,
            unless=unless,
            hold=hold,
            cooldown=cooldown,
            may_repeat=tuple(v for v, repeats in variables if repeats),
            span=_span_of(name),
            file=self.file,
        )

    def variables(self, meta: Any, parts: list[Any]) -> tuple[Any, ...]:
        return tuple(parts)

    arguments = variables

    def variable(self, meta: Any, parts: list[Any]) -> tuple[str, bool]:
        return str(parts[0]), parts[1] is not None

    def word(self, meta: Any, parts: list[Token]) -> NameArgument:
        return NameArgument(str(parts[0]), _span_of(meta))

    def when(self, meta: Any, parts: list[Any]) -> Formula:
        return self.meaning.formula(parts[0])

    unless = when

    def hold(self, meta: Any, parts: list[Any]) -> Number:
        return cast("Number", parts[0])

    cooldown = hold

    def say(self, meta: Any, parts: list[Token]) -> str:
        return str(parts[0])[1:-1]

    def or_(self, meta: Any, parts: list[Any]) -> Or:
        return Or(tuple(map(self.meaning.formula, parts)), _span_of(meta))

    def and_(self, meta: Any, parts: list[Any]) -> And:
        return And(tuple(map(self.meaning.formula, parts)), _span_of(meta))

    def not_(self, meta: Any, parts: list[Any]) -> Not:
        return Not(self.meaning.formula(parts[0]), _span_of(meta))

    def implies(self, meta: Any, parts: list[Any]) -> Or:
        first, second = map(self.meaning.formula, parts)
        return Or((Not(first, _place(first)), second), _span_of(meta))

    def iff(self, meta: Any, parts: list[Any]) -> Or:
        first, second = map(self.meaning.formula, parts)
        neither = And((Not(first, _place(first)), Not(second, _place(second))), _span_of(meta))
        return Or((And((first, second), _span_of(meta)), neither), _span_of(meta))

    def xor(self, meta: Any, parts: list[Any]) -> Or:
        first, second = map(self.meaning.formula, parts)
        one = And((first, Not(second, _place(second))), _span_of(meta))
        return Or((one, And((Not(first, _place(first)), second), _span_of(meta))), _span_of(meta))

    def release(self, meta: Any, parts: list[Any]) -> Not:
        left, window, right = parts
        one, other = (Not(f, _place(f)) for f in map(self.meaning.formula, (left, right)))
        return Not(Until(one, other, window, _span_of(meta)), _span_of(meta))

    def previous(self, meta: Any, parts: list[Any]) -> Previous:
        return Previous(self.meaning.formula(parts[0]), _span_of(meta))

    def literal(self, meta: Any, parts: list[Token]) -> Literal:
        return Literal(str(parts[0]) == "true", _span_of(meta))

    def since(self, meta: Any, parts: list[Any]) -> Since:
        left, window, right = parts
        return Since(self.meaning.formula(left), self.meaning.formula(right), window)

    def until(self, meta: Any, parts: list[Any]) -> Until:
        left, window, right = parts
        formulas = self.meaning.formula(left), self.meaning.formula(right)
        return Until(*formulas, window, _span_of(meta))

    def quantified(self, meta: Any, parts: list[Any]) -> Quantified:
        kind, (variable, repeats), part = parts
        place = _span_of(kind)
        return Quantified(str(kind), variable, self.meaning.formula(part), repeats, place)

    def let(self, meta: Any, parts: list[Any]) -> Let:
        name, value, at, part = parts
        value, at = self.meaning.term(value), self.meaning.formula(at)
        variable = Variable(str(name), value, at)
        inner = bound(self.meaning.formula(part), variable)
        return Let(str(name), value, at, inner, _span_of(name))

    def past(self, meta: Any, parts: list[Any]) -> PastOperator:
        kind, window, part = parts
        return PastOperator(str(kind), self.meaning.formula(part), window)

    def future(self, meta: Any, parts: list[Any]) -> FutureOperator:
        kind, window, part = parts
        place = _span_of(kind)
        return FutureOperator(str(kind), self.meaning.formula(part), window, place)

    def formula(self, meta: Any, parts: list[Any]) -> Formula:
        return self.meaning.formula(parts[0])

    def window(self, meta: Any, parts: list[Any]) -> TimeWindow:
        low, high = parts
        return TimeWindow(ZERO, low) if high is None else TimeWindow(low, high)

    def for_(self, meta: Any, parts: list[Any]) -> PastOperator:
        part, low, high = parts
        window = TimeWindow(ZERO, low) if high is None else TimeWindow(low, high)
        return PastOperator("always", self.meaning.formula(part), window)

    def within(self, meta: Any, parts: list[Any]) -> PastOperator:
        return replace(self.for_(meta, parts), kind="once")

    def often_time(self, meta: Any, parts: list[Any]) -> MOfN:
        part, least, of = parts
        return MOfN(self.meaning.formula(part), least, of, least.span)

    often_samples = often_time

    def comparison(self, meta: Any, parts: list[Any]) -> Formula:
        left, operator, right, leave = parts
        if isinstance(right, Literal) and operator in ("==", "!="):
            return self._redundant_truth(left, right.value == (operator == "=="), _span_of(meta))
        sides = self.meaning.term(left), self.meaning.term(right)
        return Comparison(sides[0], str(operator), sides[1], leave, _span_of(meta))

    def _redundant_truth(self, left: Any, holds: bool, span: Span) -> Formula:
        """`touching(a, b) == true`, which is just `touching(a, b)`."""
        claim = self.meaning.formula(left)
        meant: Formula = claim if holds else Not(claim, span)
        hint = f"write `{meant}`"
        self.meaning.fault((span, f"'{claim}' is true or false as it is", str(meant), hint))
        return meant

    def sum(self, meta: Any, parts: list[Any]) -> Arithmetic:
        left, operator, right = parts
        sides = self.meaning.term(left), self.meaning.term(right)
        return Arithmetic(sides[0], str(operator), sides[1], _span_of(meta))

    product = sum

    def negative(self, meta: Any, parts: list[Any]) -> Term:
        part = self.meaning.term(parts[1])
        if isinstance(part, Number):
            return Number(-part.value, part.unit, _span_of(meta))
        return Negative(part, _span_of(meta))

    def signed(self, meta: Any, parts: list[Any]) -> Number:
        minus, number = parts
        value = -number.value if minus is not None else number.value
        return Number(value, number.unit, _span_of(meta))

    def call(self, meta: Any, parts: list[Any]) -> UnresolvedCall:
        return UnresolvedCall(str(parts[0]), parts[1] or (), _span_of(meta))

    def number(self, meta: Any, parts: list[Any]) -> Number:
        unit = Unit.NONE if parts[1] is None else Unit(str(parts[1]))
        return Number(float(parts[0]), unit, _span_of(meta))

    duration = number

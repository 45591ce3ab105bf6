"""Rules in Python: the same trees as from rule files, built with operators.

>>> from visup.rules.language.rule_builder import fact, quantity, px, rule, s
>>> near = (quantity.gap("a", "b") < px(20)).lasting(s(1)) & ~fact.coupled("a", "b")
>>> made = rule("near", "a b", "warning", near, "{a} {is} near {b}.", hold=s(3))
>>> print(made)
rule near(a, b): warning
    when gap(a, b) < 20 px for 1 s and not coupled(a, b)
    hold 3 s
    say "{a} {is} near {b}."

Comparisons return a `FormulaBuilder`, which supports `&`, `|`, `~`; a `TermBuilder` supports addition,
subtraction, multiplication and division.
"""

from __future__ import annotations

from dataclasses import dataclass

from visup.agent import Severity
from visup.agent.model.errors import RuleError
from visup.rules.formula.nodes import (
    ZERO,
    And,
    Comparison,
    Formula,
    FutureOperator,
    Last,
    Let,
    MOfN,
    Not,
    Or,
    PastOperator,
    Predicate,
    Quantified,
    Rule,
    Since,
    TimeWindow,
    Until,
)
from visup.rules.formula.rebuilding import bound
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
from visup.rules.language.diagnostics import raise_all
from visup.rules.language.typecheck import TypeChecker


@dataclass(frozen=True, eq=False)
class TermBuilder:
    """A quantity with Python operators; `node` is its tree."""

    node: Term

    def __add__(self, other: TermBuilder) -> TermBuilder:
        return TermBuilder(Arithmetic(self.node, "+", other.node))

    def __sub__(self, other: TermBuilder) -> TermBuilder:
        return TermBuilder(Arithmetic(self.node, "-", other.node))

    def __mul__(self, other: TermBuilder) -> TermBuilder:
        return TermBuilder(Arithmetic(self.node, "*", other.node))

    def __truediv__(self, other: TermBuilder) -> TermBuilder:
        return TermBuilder(Arithmetic(self.node, "/", other.node))

    def __neg__(self) -> TermBuilder:
        if isinstance(self.node, Number):
            return TermBuilder(Number(-self.node.value, self.node.unit))
        return TermBuilder(Negative(self.node))

    def __abs__(self) -> TermBuilder:
        return TermBuilder(PointwiseFunction("abs", (self.node,)))

    def __lt__(self, other: TermBuilder) -> FormulaBuilder:
        return FormulaBuilder(Comparison(self.node, "<", other.node))

    def __le__(self, other: TermBuilder) -> FormulaBuilder:
        return FormulaBuilder(Comparison(self.node, "<=", other.node))

    def __gt__(self, other: TermBuilder) -> FormulaBuilder:
        return FormulaBuilder(Comparison(self.node, ">", other.node))

    def __ge__(self, other: TermBuilder) -> FormulaBuilder:
        return FormulaBuilder(Comparison(self.node, ">=", other.node))

    def over(self, function: str, span: TermBuilder) -> TermBuilder:
        """`rate`, `before`, `lowest`, `highest` or `last` over a duration: `speed.over("rate", s(2))`."""
        return TermBuilder(WindowFunction(function, self.node, _number(span)))


@dataclass(frozen=True, eq=False)
class FormulaBuilder:
    """A formula with Python operators; `node` is its tree."""

    node: Formula

    def __and__(self, other: FormulaBuilder) -> FormulaBuilder:
        parts = self.node.parts if isinstance(self.node, And) else (self.node,)
        return FormulaBuilder(And((*parts, other.node)))

    def __or__(self, other: FormulaBuilder) -> FormulaBuilder:
        parts = self.node.parts if isinstance(self.node, Or) else (self.node,)
        return FormulaBuilder(Or((*parts, other.node)))

    def __invert__(self) -> FormulaBuilder:
        return FormulaBuilder(Not(self.node))

    def lasting(self, span: TermBuilder, to: TermBuilder | None = None) -> FormulaBuilder:
        """`f for 2 s`; with `to`, `f for 2 s to 5 s ago`."""
        return FormulaBuilder(PastOperator("always", self.node, _window(span, to)))

    def within(self, span: TermBuilder, to: TermBuilder | None = None) -> FormulaBuilder:
        """`f within 2 s`; with `to`, `f within 2 s to 5 s ago`."""
        return FormulaBuilder(PastOperator("once", self.node, _window(span, to)))

    def leaving(self, bound: TermBuilder) -> FormulaBuilder:
        """A comparison that once true ends only at another bound: `... leave 3 px/s`."""
        assert isinstance(self.node, Comparison), "only a comparison has a bound to leave"
        c = self.node
        return FormulaBuilder(Comparison(c.left, c.operator, c.right, _number(bound)))

    def since(self, other: FormulaBuilder, span: TermBuilder | None = None) -> FormulaBuilder:
        """`f since g`, `f since[2 s] g`."""
        window = None if span is None else _window(span, None)
        return FormulaBuilder(Since(self.node, other.node, window))

    def until(self, other: FormulaBuilder, span: TermBuilder) -> FormulaBuilder:
        """`f until[2 s] g`."""
        return FormulaBuilder(Until(self.node, other.node, _window(span, None)))

    def often(self, least: TermBuilder, of: TermBuilder) -> FormulaBuilder:
        """`f in 60 % of 2 s` by `often(percent(60), s(2))`, `f in 3 of 5 samples` by numbers."""
        return FormulaBuilder(MOfN(self.node, _number(least), _number(of)))

    def last(self, span: TermBuilder) -> FormulaBuilder:
        """`last(f, 0.5 s)`."""
        return FormulaBuilder(Last(self.node, _number(span)))


def once(claim: FormulaBuilder) -> FormulaBuilder:
    """`once f`."""
    return FormulaBuilder(PastOperator("once", claim.node))


def always(claim: FormulaBuilder) -> FormulaBuilder:
    """`always f`."""
    return FormulaBuilder(PastOperator("always", claim.node))


def eventually(
    claim: FormulaBuilder, span: TermBuilder, to: TermBuilder | None = None
) -> FormulaBuilder:
    """`eventually[2 s] f`; with `to`, `eventually[2 s .. 5 s] f`."""
    return FormulaBuilder(FutureOperator("eventually", claim.node, _window(span, to)))


def henceforth(
    claim: FormulaBuilder, span: TermBuilder, to: TermBuilder | None = None
) -> FormulaBuilder:
    """`henceforth[2 s] f`; with `to`, `henceforth[2 s .. 5 s] f`."""
    return FormulaBuilder(FutureOperator("henceforth", claim.node, _window(span, to)))


def exists(variable: str, claim: FormulaBuilder, may_repeat: bool = False) -> FormulaBuilder:
    """`exists b: f`."""
    return FormulaBuilder(Quantified("exists", variable, claim.node, may_repeat))


def forall(variable: str, claim: FormulaBuilder, may_repeat: bool = False) -> FormulaBuilder:
    """`forall b: f`."""
    return FormulaBuilder(Quantified("forall", variable, claim.node, may_repeat))


def noted(name: str) -> TermBuilder:
    """The value bound by `let`."""
    return TermBuilder(Variable(name))


def let(name: str, value: TermBuilder, at: FormulaBuilder, claim: FormulaBuilder) -> FormulaBuilder:
    """`let x be q at f: g`, where g uses `noted("x")`."""
    part = bound(claim.node, Variable(name, value.node, at.node))
    return FormulaBuilder(Let(name, value.node, at.node, part))


def least(*amounts: TermBuilder) -> TermBuilder:
    """`min(...)`."""
    return TermBuilder(PointwiseFunction("min", tuple(a.node for a in amounts)))


def greatest(*amounts: TermBuilder) -> TermBuilder:
    """`max(...)`."""
    return TermBuilder(PointwiseFunction("max", tuple(a.node for a in amounts)))


class _Facts:
    """`fact.converging("a", "b")` for any word."""

    def __getattr__(self, name: str) -> _Fact:
        return _Fact(name)


class _Quantities:
    """`quantity.gap("a", "b")` for any quantity."""

    def __getattr__(self, name: str) -> _Quantity:
        return _Quantity(name)


@dataclass(frozen=True)
class _Fact:
    name: str

    def __call__(self, *words: str) -> FormulaBuilder:
        return FormulaBuilder(Predicate(self.name, words))


@dataclass(frozen=True)
class _Quantity:
    name: str

    def __call__(self, *words: str) -> TermBuilder:
        return TermBuilder(Measure(self.name, words))


fact, quantity = _Facts(), _Quantities()


def number(value: float, unit: Unit = Unit.NONE) -> TermBuilder:
    """A number with any unit."""
    return TermBuilder(Number(float(value), unit))


def s(value: float) -> TermBuilder:
    """Seconds."""
    return number(value, Unit.S)


def px(value: float) -> TermBuilder:
    """Pixels."""
    return number(value, Unit.PX)


def px_s(value: float) -> TermBuilder:
    """Pixels per second."""
    return number(value, Unit.PX_S)


def percent(value: float) -> TermBuilder:
    """Per cent."""
    return number(value, Unit.PERCENT)


def deg_s(value: float) -> TermBuilder:
    """Degrees per second."""
    return number(value, Unit.DEG_S)


def rule(
    name: str,
    variables: str,
    severity: str,
    when: FormulaBuilder,
    say: str,
    *,
    unless: FormulaBuilder | None = None,
    hold: TermBuilder | None = None,
    cooldown: TermBuilder | None = None,
    may_repeat: str = "",
) -> Rule:
    """A rule, checked like those of files.

    Args:
        name: Its name.
        variables: Names of its objects, separated by blanks.
        severity: 'info', 'warning' or 'critical'.
        when: The condition.
        say: The sentence.
        unless: The exception.
        hold: How long its alarm stays.
        cooldown: How long the same objects raise no alarm afterwards.
        may_repeat: Variables that may be bound to the object of another one.

    Returns:
        The same tree as parsed from its text.

    Raises:
        RuleError: It has one error; the location refers to its printed text.
        ManyErrors: It has several.
    """
    made = Rule(
        name,
        tuple(variables.split()),
        Severity[severity.upper()],
        when.node,
        say,
        None if unless is None else unless.node,
        None if hold is None else _number(hold),
        None if cooldown is None else _number(cooldown),
        tuple(may_repeat.split()),
    )
    raise_all(list(TypeChecker(str(made), f"<rule {name}>").rule(made)), RuleError)
    return made


def _number(amount: TermBuilder) -> Number:
    assert isinstance(amount.node, Number), "a plain number is expected here"
    return amount.node


def _window(span: TermBuilder, to: TermBuilder | None) -> TimeWindow:
    return TimeWindow(ZERO, _number(span)) if to is None else TimeWindow(_number(span), _number(to))

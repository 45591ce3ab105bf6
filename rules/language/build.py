"""Rules in Python: the same trees as rule files give, built with operators.

>>> from visup.rules.language.build import fact, quantity, px, rule, s
>>> near = (quantity.gap("a", "b") < px(20)).lasting(s(1)) & ~fact.coupled("a", "b")
>>> made = rule("near", "a b", "warning", near, "{a} {is} near {b}.", hold=s(3))
>>> print(made)
rule near(a, b): warning
    when gap(a, b) < 20 px for 1 s and not coupled(a, b)
    hold 3 s
    say "{a} {is} near {b}."

Comparisons give a `Claim`; claims join with `&`, `|`, `~`. Amounts add, subtract, multiply and divide.
"""

from __future__ import annotations

from dataclasses import dataclass

from visup.agent import Severity
from visup.rules.formula.nodes import (
    ZERO,
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
from visup.rules.formula.terms import Arithmetic, Combined, Measure, Negative, OverTime, Term
from visup.rules.formula.units import Number, Unit
from visup.rules.language.parser import raise_all
from visup.rules.language.typecheck import Checker


@dataclass(frozen=True, eq=False)
class Amount:
    """A quantity that Python's operators work on; `node` is its tree."""

    node: Term

    def __add__(self, other: Amount) -> Amount:
        return Amount(Arithmetic(self.node, "+", other.node))

    def __sub__(self, other: Amount) -> Amount:
        return Amount(Arithmetic(self.node, "-", other.node))

    def __mul__(self, other: Amount) -> Amount:
        return Amount(Arithmetic(self.node, "*", other.node))

    def __truediv__(self, other: Amount) -> Amount:
        return Amount(Arithmetic(self.node, "/", other.node))

    def __neg__(self) -> Amount:
        if isinstance(self.node, Number):
            return Amount(Number(-self.node.value, self.node.unit))
        return Amount(Negative(self.node))

    def __abs__(self) -> Amount:
        return Amount(Combined("abs", (self.node,)))

    def __lt__(self, other: Amount) -> Claim:
        return Claim(Comparison(self.node, "<", other.node))

    def __le__(self, other: Amount) -> Claim:
        return Claim(Comparison(self.node, "<=", other.node))

    def __gt__(self, other: Amount) -> Claim:
        return Claim(Comparison(self.node, ">", other.node))

    def __ge__(self, other: Amount) -> Claim:
        return Claim(Comparison(self.node, ">=", other.node))

    def over(self, function: str, span: Amount) -> Amount:
        """`rate`, `before`, `lowest`, `highest` or `last` over a time: `speed.over("rate", s(2))`."""
        return Amount(OverTime(function, self.node, _number(span)))


@dataclass(frozen=True, eq=False)
class Claim:
    """A formula that Python's operators work on; `node` is its tree."""

    node: Formula

    def __and__(self, other: Claim) -> Claim:
        parts = self.node.parts if isinstance(self.node, And) else (self.node,)
        return Claim(And((*parts, other.node)))

    def __or__(self, other: Claim) -> Claim:
        parts = self.node.parts if isinstance(self.node, Or) else (self.node,)
        return Claim(Or((*parts, other.node)))

    def __invert__(self) -> Claim:
        return Claim(Not(self.node))

    def lasting(self, span: Amount, to: Amount | None = None) -> Claim:
        """`f for 2 s`; with `to`, `f for 2 s to 5 s ago`."""
        return Claim(Past("always", self.node, _window(span, to)))

    def within(self, span: Amount, to: Amount | None = None) -> Claim:
        """`f within 2 s`; with `to`, `f within 2 s to 5 s ago`."""
        return Claim(Past("once", self.node, _window(span, to)))

    def leaving(self, bound: Amount) -> Claim:
        """A comparison that, once true, ends only at another bound: `... leave 3 px/s`."""
        assert isinstance(self.node, Comparison), "only a comparison has a bound to leave"
        c = self.node
        return Claim(Comparison(c.left, c.operator, c.right, _number(bound)))

    def since(self, other: Claim, span: Amount | None = None) -> Claim:
        """`f since g`, `f since[2 s] g`."""
        window = None if span is None else _window(span, None)
        return Claim(Since(self.node, other.node, window))

    def until(self, other: Claim, span: Amount) -> Claim:
        """`f until[2 s] g`."""
        return Claim(Until(self.node, other.node, _window(span, None)))

    def often(self, least: Amount, of: Amount) -> Claim:
        """`f in 60 % of 2 s` by `often(percent(60), s(2))`, `f in 3 of 5 samples` by numbers."""
        return Claim(Often(self.node, _number(least), _number(of)))

    def last(self, span: Amount) -> Claim:
        """`last(f, 0.5 s)`."""
        return Claim(Last(self.node, _number(span)))


def once(claim: Claim) -> Claim:
    """`once f`."""
    return Claim(Past("once", claim.node))


def always(claim: Claim) -> Claim:
    """`always f`."""
    return Claim(Past("always", claim.node))


def eventually(claim: Claim, span: Amount, to: Amount | None = None) -> Claim:
    """`eventually[2 s] f`; with `to`, `eventually[2 s .. 5 s] f`."""
    return Claim(Future("eventually", claim.node, _window(span, to)))


def henceforth(claim: Claim, span: Amount, to: Amount | None = None) -> Claim:
    """`henceforth[2 s] f`; with `to`, `henceforth[2 s .. 5 s] f`."""
    return Claim(Future("henceforth", claim.node, _window(span, to)))


def exists(variable: str, claim: Claim, may_repeat: bool = False) -> Claim:
    """`exists b: f`."""
    return Claim(Quantified("exists", variable, claim.node, may_repeat))


def forall(variable: str, claim: Claim, may_repeat: bool = False) -> Claim:
    """`forall b: f`."""
    return Claim(Quantified("forall", variable, claim.node, may_repeat))


def least(*amounts: Amount) -> Amount:
    """`min(...)`."""
    return Amount(Combined("min", tuple(a.node for a in amounts)))


def greatest(*amounts: Amount) -> Amount:
    """`max(...)`."""
    return Amount(Combined("max", tuple(a.node for a in amounts)))


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

    def __call__(self, *words: str) -> Claim:
        return Claim(Predicate(self.name, words))


@dataclass(frozen=True)
class _Quantity:
    name: str

    def __call__(self, *words: str) -> Amount:
        return Amount(Measure(self.name, words))


fact, quantity = _Facts(), _Quantities()


def number(value: float, unit: Unit = Unit.NONE) -> Amount:
    """A number with any unit."""
    return Amount(Number(float(value), unit))


def s(value: float) -> Amount:
    """Seconds."""
    return number(value, Unit.S)


def px(value: float) -> Amount:
    """Pixels."""
    return number(value, Unit.PX)


def px_s(value: float) -> Amount:
    """Pixels per second."""
    return number(value, Unit.PX_S)


def percent(value: float) -> Amount:
    """Hundredths."""
    return number(value, Unit.PERCENT)


def deg_s(value: float) -> Amount:
    """Degrees per second."""
    return number(value, Unit.DEG_S)


def rule(
    name: str,
    variables: str,
    severity: str,
    when: Claim,
    say: str,
    *,
    unless: Claim | None = None,
    hold: Amount | None = None,
    cooldown: Amount | None = None,
    may_repeat: str = "",
) -> Rule:
    """A rule, checked as those of files are.

    Args:
        name: Its name.
        variables: Names of its objects, with blanks between them.
        severity: 'info', 'warning' or 'critical'.
        when: What must be true.
        say: The sentence.
        unless: What suspends it.
        hold: How long its concern stays.
        cooldown: How long the same objects raise none afterwards.
        may_repeat: Variables that may stand for an object of another one.

    Returns:
        The same tree as its text gives.

    Raises:
        RuleError: It has one fault; the place is in its text as printed.
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
    raise_all(list(Checker(str(made), f"<rule {name}>").rule(made)))
    return made


def _number(amount: Amount) -> Number:
    assert isinstance(amount.node, Number), "a plain number is wanted here"
    return amount.node


def _window(span: Amount, to: Amount | None) -> Window:
    return Window(ZERO, _number(span)) if to is None else Window(_number(span), _number(to))

"""The tree of a rule file: frozen nodes that print themselves back as source."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum

from visup.agent import Severity


@dataclass(frozen=True, slots=True)
class Span:
    """Where a node stands in its file: line and column from 1, length in characters."""

    line: int = 1
    column: int = 1
    length: int = 1


class Unit(StrEnum):
    """What a number counts."""

    NONE = ""
    S = "s"
    MS = "ms"
    MIN = "min"
    PX = "px"
    PX_S = "px/s"
    PERCENT = "%"
    DEG = "deg"


DIMENSION = {
    Unit.NONE: ("number", 1.0),
    Unit.S: ("time", 1.0),
    Unit.MS: ("time", 0.001),
    Unit.MIN: ("time", 60.0),
    Unit.PX: ("length", 1.0),
    Unit.PX_S: ("speed", 1.0),
    Unit.PERCENT: ("share", 0.01),
    Unit.DEG: ("angle", 1.0),
}
"""Unit -> what it measures, and how many of the base unit it is."""


@dataclass(frozen=True, slots=True)
class Number:
    """`20 s`: a number with its unit."""

    value: float
    unit: Unit = Unit.NONE
    span: Span = field(default=Span(), compare=False, repr=False)

    @property
    def base(self) -> float:
        """The number in the base unit of its dimension: seconds, pixels, share of one."""
        return self.value * DIMENSION[self.unit][1]

    def __str__(self) -> str:
        digits = f"{self.value:.10f}".rstrip("0").rstrip(".")
        return f"{digits} {self.unit}".rstrip()


@dataclass(frozen=True, slots=True)
class Measure:
    """`time_to_contact(a, b)`: a quantity of objects."""

    name: str
    words: tuple[str, ...]
    span: Span = field(default=Span(), compare=False, repr=False)

    def __str__(self) -> str:
        return f"{self.name}({', '.join(self.words)})"


@dataclass(frozen=True, slots=True)
class Predicate:
    """`converging(a, b)`: a relation or a fact."""

    name: str
    words: tuple[str, ...]
    span: Span = field(default=Span(), compare=False, repr=False)

    def __str__(self) -> str:
        return f"{self.name}({', '.join(self.words)})"


@dataclass(frozen=True, slots=True)
class Comparison:
    """`gap(a, b) < 20 px`."""

    left: Measure | Number
    operator: str
    right: Measure | Number
    span: Span = field(default=Span(), compare=False, repr=False)

    def __str__(self) -> str:
        return f"{self.left} {self.operator} {self.right}"


@dataclass(frozen=True, slots=True)
class Not:
    """`not f`."""

    part: Formula

    def __str__(self) -> str:
        return f"not {_wrapped(self.part, And, Or)}"


@dataclass(frozen=True, slots=True)
class And:
    """`f and g`."""

    parts: tuple[Formula, ...]

    def __str__(self) -> str:
        return " and ".join(_wrapped(p, And, Or) for p in self.parts)


@dataclass(frozen=True, slots=True)
class Or:
    """`f or g`."""

    parts: tuple[Formula, ...]

    def __str__(self) -> str:
        return " or ".join(_wrapped(p, Or) for p in self.parts)


@dataclass(frozen=True, slots=True)
class For:
    """`f for 2 s`: f has been true without a break for so long."""

    part: Formula
    duration: Number

    def __str__(self) -> str:
        return f"{_wrapped(self.part, And, Or, Not, For)} for {self.duration}"


Formula = Predicate | Comparison | Not | And | Or | For


@dataclass(frozen=True, slots=True)
class Rule:
    """One rule.

    Attributes:
        name: Also the kind of its concerns.
        variables: Names of its objects, all distinct objects.
        severity: How grave its concerns are.
        when: What must be true.
        say: The sentence, with `{a}` for objects and `{is}` for the verb.
        unless: What must not be true, or None.
        hold: How long a concern stays after the rule was last true, or None.
        file: Where it was read, for messages.
    """

    name: str
    variables: tuple[str, ...]
    severity: Severity
    when: Formula
    say: str
    unless: Formula | None = None
    hold: Number | None = None
    span: Span = field(default=Span(), compare=False, repr=False)
    file: str = field(default="", compare=False, repr=False)

    def __str__(self) -> str:
        lines = [f"rule {self.name}({', '.join(self.variables)}): {self.severity.name.lower()}"]
        lines.append(f"    when {self.when}")
        if self.unless is not None:
            lines.append(f"    unless {self.unless}")
        if self.hold is not None:
            lines.append(f"    hold {self.hold}")
        lines.append(f'    say "{self.say}"')
        return "\n".join(lines)


def children(formula: Formula) -> tuple[Formula, ...]:
    """The formulas that a formula is made of directly."""
    if isinstance(formula, And | Or):
        return formula.parts
    return (formula.part,) if isinstance(formula, Not | For) else ()


def atoms(formula: Formula | None) -> tuple[Predicate | Comparison, ...]:
    """All predicates and comparisons of a formula, in the order of the text."""
    if formula is None:
        return ()
    if isinstance(formula, Predicate | Comparison):
        return (formula,)
    return tuple(a for part in children(formula) for a in atoms(part))


def _wrapped(formula: Formula, *loose: type) -> str:
    return f"({formula})" if isinstance(formula, loose) else str(formula)

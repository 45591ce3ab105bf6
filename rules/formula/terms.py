"""AST nodes of quantities: frozen, and printed back as source."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from visup.rules.formula.units import NOWHERE, Number, Span

POINTWISE = ("abs", "min", "max", "sqrt", "exp", "power")
"""Pointwise functions; of one quantity, except `min`, `max` and `power`."""
OVER_WINDOW = ("rate", "before", "lowest", "highest", "last")
"""Functions of a quantity and a duration."""


@dataclass(frozen=True, slots=True)
class Measure:
    """`time_to_contact(a, b)`: a quantity of objects."""

    name: str
    arguments: tuple[str, ...] = ()
    span: Span = field(default=NOWHERE, compare=False, repr=False)

    def __str__(self) -> str:
        return f"{self.name}({', '.join(self.arguments)})"


@dataclass(frozen=True, slots=True)
class Arithmetic:
    """`gap(a, b) - 3 px`, also with `+`, `*` and `/`."""

    left: Term
    operator: str
    right: Term
    span: Span = field(default=NOWHERE, compare=False, repr=False)

    def __str__(self) -> str:
        loose = ("+", "-") if self.operator in "*/" else ()
        return f"{_wrapped(self.left, loose)} {self.operator} {_wrapped(self.right, '+-*/')}"


@dataclass(frozen=True, slots=True)
class Negative:
    """`-gap(a, b)`; the negative of a number is a number."""

    part: Term
    span: Span = field(default=NOWHERE, compare=False, repr=False)

    def __str__(self) -> str:
        return f"-{_wrapped(self.part, '+-*/')}"


@dataclass(frozen=True, slots=True)
class PointwiseFunction:
    """`min(gap(a, b), gap(a, c))`: one of `POINTWISE`, of quantities of one dimension."""

    name: str
    parts: tuple[Term, ...]
    span: Span = field(default=NOWHERE, compare=False, repr=False)

    def __str__(self) -> str:
        return f"{self.name}({', '.join(map(str, self.parts))})"


@dataclass(frozen=True, slots=True)
class WindowFunction:
    """`rate(gap(a, b), 2 s)`: one of `OVER_WINDOW` of a quantity."""

    name: str
    part: Term
    duration: Number
    span: Span = field(default=NOWHERE, compare=False, repr=False)

    def __str__(self) -> str:
        return f"{self.name}({self.part}, {self.duration})"


@dataclass(frozen=True, slots=True)
class Variable:
    """`x` in `let x be gap(a, b) at touching(a, b): gap(a, b) > x`.

    Attributes:
        name: Its name.
        part: The quantity; None for a name not bound by a `let`.
        at: The formula; the value is that of `part` when this was last true.
    """

    name: str
    part: Term | None = None
    at: Any = None
    span: Span = field(default=NOWHERE, compare=False, repr=False)

    def __str__(self) -> str:
        return self.name


Term = Number | Measure | Arithmetic | Negative | PointwiseFunction | WindowFunction | Variable


def _wrapped(term: Term, loose: str | tuple[str, ...]) -> str:
    return f"({term})" if isinstance(term, Arithmetic) and term.operator in loose else str(term)

"""Conditions of tasks: those of rules, with actors instead of object variables.

An action is a predicate whose arguments are actors and zones; `not`, `and`, `or`, comparisons and numbers are
those of `rules/formula`. This module adds what is specific to tasks: names with source positions, and
parameters in place of numbers.

Read next: `ast_courses.py` (courses), `nodes.py` (the file as a whole).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import TypeAlias, cast

from visup.rules.formula.nodes import (
    ZERO,
    And,
    Comparison,
    Not,
    Or,
    PastOperator,
    Predicate,
    TimeWindow,
    walk,
)
from visup.rules.formula.terms import Measure
from visup.rules.formula.units import NOWHERE, Number, Span

Action: TypeAlias = Predicate
"""`converging(arm, satellite)`: a relation that should hold between actors."""


class Name(str):
    """A name with its source position, such as an actor in an action; equal to its text.

    Args:
        text: The name.
        span: Its position.
    """

    span: Span

    def __new__(cls, text: str, span: Span = NOWHERE) -> Name:
        """Create a name at a position."""
        name = super().__new__(cls, text)
        name.span = span
        return name


class PartName(Name):
    """`gripper of arm` in place of an actor: the actor `gripper`, and its machine.

    Args:
        text: The name of the part.
        machine: The actor of which it is a part.
        span: Position of both.
    """

    machine: Name

    def __new__(cls, text: str, machine: Name, span: Span = NOWHERE) -> PartName:
        """Create a part at a position."""
        name = cast("PartName", super().__new__(cls, text, span))
        name.machine = machine
        return name


@dataclass(frozen=True, slots=True)
class ParameterRef:
    """`patience`: the name of a parameter in place of a number; see `Task.amount`."""

    name: str
    span: Span = field(default=NOWHERE, compare=False, repr=False)

    def __str__(self) -> str:
        return self.name


Amount: TypeAlias = Number | ParameterRef


@dataclass(frozen=True, slots=True)
class Range:
    """`20 px and 100 px`: the operand of `between`, inclusive."""

    low: Amount
    high: Amount
    span: Span = field(default=NOWHERE, compare=False, repr=False)

    def __str__(self) -> str:
        return f"{self.low} and {self.high}"


EVERY = "every"
"""In place of a comparison operator: a periodic action."""


@dataclass(frozen=True, slots=True)
class Period:
    """`2 s to 4 s`: the operand of `every`, the time between two occurrences.

    Attributes:
        least: The shortest, or None for no limit.
        most: The longest.
    """

    least: Amount | None
    most: Amount
    span: Span = field(default=NOWHERE, compare=False, repr=False)

    def __str__(self) -> str:
        return f"{self.least} to {self.most}" if self.least else str(self.most)


@dataclass(frozen=True, slots=True)
class Lasted(PastOperator):
    """`(touching(a, b) for 2 s)`: a nested condition that must have held for a duration."""

    span: Span = field(default=NOWHERE, compare=False, repr=False)

    @property
    def duration(self) -> Amount:
        """The duration."""
        assert self.window is not None
        return cast("Amount", self.window.high)

    def __str__(self) -> str:
        return f"({self.part} for {self.duration})"


def lasted(part: Condition, duration: Amount, span: Span = NOWHERE) -> Lasted:
    """A condition that must have held for a duration."""
    return Lasted("always", part, TimeWindow(ZERO, cast("Number", duration)), span)


Fact: TypeAlias = Predicate | Comparison
Condition: TypeAlias = Predicate | Comparison | Not | And | Or | Lasted


def facts_of(condition: Condition) -> Iterator[Fact]:
    """The actions and comparisons of a condition, in the order of the text."""
    return (n for n in walk(condition) if isinstance(n, Predicate | Comparison))


def durations_of(condition: Condition) -> Iterator[Amount]:
    """The durations within a condition."""
    return (n.duration for n in walk(condition) if isinstance(n, Lasted))


def action_of(fact: Fact) -> Predicate | Measure:
    """The action itself, or the quantity of a comparison with its objects."""
    return cast("Measure", fact.left) if isinstance(fact, Comparison) else fact


def bounds_of(comparison: Comparison) -> tuple[Amount, ...]:
    """The operands of a comparison: one amount, or the ends of a range or period."""
    right = cast("Amount | Range | Period", comparison.right)
    if isinstance(right, Period):
        return (right.most,) if right.least is None else (right.least, right.most)
    return (right.low, right.high) if isinstance(right, Range) else (right,)


def is_periodic(fact: Fact) -> bool:
    """Whether a fact is a periodic action."""
    return isinstance(fact, Comparison) and fact.operator == EVERY


def once(periodic: Comparison) -> Predicate:
    """The action of a periodic one."""
    again = action_of(periodic)
    return Predicate(again.name, again.arguments, again.span)


def actors_of(fact: Fact) -> tuple[Name, ...]:
    """The actors and zones of a fact, with positions."""
    return cast("tuple[Name, ...]", action_of(fact).arguments)

"""What holds or does not: actions, comparisons, and what `not`, `and`, `or` make of them.

Frozen nodes of the tree of a task file, each of which prints itself back as source.

Read next: `ast_courses.py` (courses), `nodes.py` (the file as a whole).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Literal, TypeAlias


@dataclass(frozen=True, slots=True)
class Span:
    """Where a node stands: lines and columns counted from 1, the end column exclusive.

    Attributes:
        file: The included file in which it stands; empty for the file itself.
    """

    line: int = 0
    column: int = 0
    end_line: int = 0
    end_column: int = 0
    file: str = ""


NOWHERE = Span()


@dataclass(frozen=True, slots=True)
class Name:
    """A name where it is used, such as an actor in an action."""

    text: str
    span: Span = field(default=NOWHERE, compare=False, repr=False)

    def __str__(self) -> str:
        return self.text


@dataclass(frozen=True, slots=True)
class Amount:
    """A number with its unit, as written (`60 s`, `20 px`), or the name of a parameter.

    Attributes:
        number: The number; 0 when a parameter is named.
        unit: Its unit; empty when a parameter is named.
        parameter: The parameter, or empty. `Task.amount` gives what it stands for.
    """

    number: float
    unit: str = "s"
    parameter: str = ""
    span: Span = field(default=NOWHERE, compare=False, repr=False)

    def __str__(self) -> str:
        return self.parameter or f"{number_text(self.number)} {self.unit}"


@dataclass(frozen=True, slots=True)
class Action:
    """`converging(arm, satellite)`: a relation that should hold between actors."""

    name: str
    actors: tuple[Name, ...]
    span: Span = field(default=NOWHERE, compare=False, repr=False)

    def __str__(self) -> str:
        return f"{self.name}({', '.join(map(str, self.actors))})"


@dataclass(frozen=True, slots=True)
class Comparison:
    """`gap(arm, satellite) < 20 px`: a quantity that should be below or above an amount."""

    quantity: Action
    sign: Literal["<", "<=", ">", ">="]
    amount: Amount
    span: Span = field(default=NOWHERE, compare=False, repr=False)

    def __str__(self) -> str:
        return f"{self.quantity} {self.sign} {self.amount}"


@dataclass(frozen=True, slots=True)
class Not:
    """`not touching(arm, satellite)`."""

    item: Condition
    span: Span = field(default=NOWHERE, compare=False, repr=False)

    def __str__(self) -> str:
        return f"not {_within(self.item, (Action, Comparison))}"


@dataclass(frozen=True, slots=True)
class And:
    """`touching(a, b) and present(c)`: all of them."""

    parts: tuple[Condition, ...]
    span: Span = field(default=NOWHERE, compare=False, repr=False)

    def __str__(self) -> str:
        return " and ".join(_within(p, (Action, Comparison, Not)) for p in self.parts)


@dataclass(frozen=True, slots=True)
class Or:
    """`touching(a, b) or coupled(a, b)`: at least one of them."""

    parts: tuple[Condition, ...]
    span: Span = field(default=NOWHERE, compare=False, repr=False)

    def __str__(self) -> str:
        return " or ".join(_within(p, (Action, Comparison, Not, And)) for p in self.parts)


Fact: TypeAlias = Action | Comparison
Condition: TypeAlias = Action | Comparison | Not | And | Or


def parts_of(condition: Condition) -> tuple[Condition, ...]:
    """The conditions directly inside one."""
    match condition:
        case And(parts=parts) | Or(parts=parts):
            return parts
        case Not(item=item):
            return (item,)
    return ()


def facts_of(condition: Condition) -> Iterator[Fact]:
    """The actions and comparisons of a condition, in the order of the text."""
    if isinstance(condition, Action | Comparison):
        yield condition
    for part in parts_of(condition):
        yield from facts_of(part)


def action_of(fact: Fact) -> Action:
    """An action itself, or the quantity of a comparison with those between whom it is measured."""
    return fact.quantity if isinstance(fact, Comparison) else fact


def number_text(number: float) -> str:
    """A number as one writes it: whole ones without a point."""
    if number == float("inf"):
        return "1e999"
    return str(int(number)) if number == int(number) and abs(number) < 1e15 else repr(number)


def _within(condition: Condition, kinds: tuple[type, ...]) -> str:
    """A condition as text, in brackets unless it is of a kind that needs none there."""
    return str(condition) if isinstance(condition, kinds) else f"({condition})"

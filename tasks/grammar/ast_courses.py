"""Courses: the content of stages, as frozen nodes that print themselves as source.

Read before: `conditions.py` (actions and conditions). Read next: `nodes.py` (the file as a whole).
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Literal, TypeAlias

from visup.rules.formula.nodes import Comparison
from visup.rules.formula.units import NOWHERE, Span
from visup.tasks.grammar.conditions import Action, Amount, Condition


@dataclass(frozen=True, slots=True)
class Hold:
    """`for 5 s`: the preceding course must hold for that long without interruption."""

    duration: Amount
    span: Span = field(default=NOWHERE, compare=False, repr=False)

    def __str__(self) -> str:
        return f"for {self.duration}"


@dataclass(frozen=True, slots=True)
class Deadline:
    """`within 60 s`: the preceding course must end within that time after its beginning."""

    duration: Amount
    span: Span = field(default=NOWHERE, compare=False, repr=False)

    def __str__(self) -> str:
        return f"within {self.duration}"


@dataclass(frozen=True, slots=True)
class Delay:
    """`after 10 s to 60 s`: the course begins within this interval after the end of its predecessor.

    Attributes:
        duration: The least delay.
        most: The greatest delay, or None for no limit.
    """

    duration: Amount
    most: Amount | None = None
    span: Span = field(default=NOWHERE, compare=False, repr=False)

    def __str__(self) -> str:
        return f"after {self.duration}" + (f" to {self.most}" if self.most else "")


Clause: TypeAlias = Hold | Deadline | Delay
ConditionKind: TypeAlias = Literal["begins", "ends", "progresses", "fails", "pauses"]


@dataclass(frozen=True, slots=True)
class StageCondition:
    """`fails when diverging(a, b) for 2 s`: by what an action begins, ends, progresses, fails or is paused.

    Attributes:
        kind: One of the five kinds.
        condition: The condition.
        lasting: How long it must hold without interruption, or None.
    """

    kind: ConditionKind
    condition: Condition
    lasting: Hold | None = None
    span: Span = field(default=NOWHERE, compare=False, repr=False)

    def __str__(self) -> str:
        lasting = f" {self.lasting}" if self.lasting else ""
        return f"{self.kind} when {self.condition}{lasting}"


@dataclass(frozen=True, slots=True)
class Reference:
    """`<approach>`: a reference to a stage."""

    stage: str
    span: Span = field(default=NOWHERE, compare=False, repr=False)

    def __str__(self) -> str:
        return f"<{self.stage}>"


@dataclass(frozen=True, slots=True)
class Repeated:
    """`a?` (optional), `a*` (any number of times), `a+` (at least once)."""

    item: Course
    mark: Literal["?", "*", "+"]
    span: Span = field(default=NOWHERE, compare=False, repr=False)

    def __str__(self) -> str:
        return f"{_within(self.item, ATOM)}{self.mark}"


@dataclass(frozen=True, slots=True)
class Counted:
    """`a at least 2 times at most 5 times`.

    Attributes:
        least: Least count; 1 by default, 0 for an optional course.
        most: Greatest count, or None.
    """

    item: Course
    least: int = 1
    most: int | None = None
    span: Span = field(default=NOWHERE, compare=False, repr=False)

    def __str__(self) -> str:
        return f"{_within(self.item, CLAUSED, Counted)} {self.times}"

    @property
    def times(self) -> str:
        """The count as source text."""
        said = []
        if self.least != 1 or self.most is None:
            said.append(f"at least {self.least} {_times(self.least)}")
        if self.most is not None:
            said.append(f"at most {self.most} {_times(self.most)}")
        return " ".join(said)


@dataclass(frozen=True, slots=True)
class Timed:
    """`a for 5 s within 60 s`: a course with clauses."""

    item: Course
    clauses: tuple[Clause, ...]
    span: Span = field(default=NOWHERE, compare=False, repr=False)

    def __str__(self) -> str:
        return " ".join([_within(self.item, CLAUSED, Timed), *map(str, self.clauses)])


@dataclass(frozen=True, slots=True)
class Conditioned:
    """`a begins when b fails when c`: a course with its own stage conditions."""

    item: Course
    conditions: tuple[StageCondition, ...]
    span: Span = field(default=NOWHERE, compare=False, repr=False)

    def __str__(self) -> str:
        return " ".join([_within(self.item, CLAUSED), *map(str, self.conditions)])


@dataclass(frozen=True, slots=True)
class Together:
    """`a & b`: at the same time."""

    parts: tuple[Course, ...]
    span: Span = field(default=NOWHERE, compare=False, repr=False)

    def __str__(self) -> str:
        return " & ".join(_within(p, JUDGED) for p in self.parts)


@dataclass(frozen=True, slots=True)
class AnyOrder:
    """`any order (a, b, c)`, `any 2 of (a, b, c)`, `for each new part a`: once each, one after the other.

    Attributes:
        count: Greatest number of items; None for all.
        copies: Kind and number of the things that the items are for, such as `leg` and 4; or None.
        least: Least number of items; None for the same as `count`.
        new: The actor that is a new one in each round, such as `part`; or empty.
    """

    items: tuple[Course, ...]
    span: Span = field(default=NOWHERE, compare=False, repr=False)
    count: int | None = None
    copies: tuple[str, int] | None = field(default=None, compare=False, repr=False)
    least: int | None = None
    new: str = ""

    def __str__(self) -> str:
        if self.new:
            return self._rounds()
        said = "any order" if self.count is None else f"any {self.count} of"
        return f"{said} ({', '.join(map(str, self.items))})"

    def _rounds(self) -> str:
        round_ = re.sub(rf"\b{self.new}_1\b", self.new, _within(self.items[0], ATOM))
        most = "" if self.count is None else f" at most {self.count} {_times(self.count)}"
        if self.least == 1 and not most:
            return f"for each new {self.new} {round_}"
        return f"(for each new {self.new} {round_} at least {self.least} {_times(self.least or 0)}{most})"


@dataclass(frozen=True, slots=True)
class Already:
    """`already a`: also satisfied by an action that holds since before its turn."""

    item: Course
    span: Span = field(default=NOWHERE, compare=False, repr=False)

    def __str__(self) -> str:
        return f"already {_within(self.item, ATOM)}"


@dataclass(frozen=True, slots=True)
class Sequence:
    """`a b`: one after the other."""

    items: tuple[Course, ...]
    span: Span = field(default=NOWHERE, compare=False, repr=False)

    def __str__(self) -> str:
        return " ".join(_within(i, TOGETHER) for i in self.items)


@dataclass(frozen=True, slots=True)
class Choice:
    """`a | b`: one of them."""

    options: tuple[Course, ...]
    span: Span = field(default=NOWHERE, compare=False, repr=False)

    def __str__(self) -> str:
        return " | ".join(_within(o, SEQUENCE) for o in self.options)


Course: TypeAlias = (
    Choice
    | Sequence
    | Together
    | AnyOrder
    | Already
    | Conditioned
    | Timed
    | Counted
    | Repeated
    | Action
    | Comparison
    | Reference
)
"""The content of a stage."""

CHOICE, SEQUENCE, TOGETHER, JUDGED, CLAUSED, REPEATED, ATOM = range(7)
BINDS: dict[type, int] = {
    Choice: CHOICE,
    Sequence: SEQUENCE,
    Together: TOGETHER,
    Conditioned: JUDGED,
    Timed: CLAUSED,
    Counted: CLAUSED,
    Repeated: REPEATED,
}


def children(course: Course) -> tuple[Course, ...]:
    """The courses directly inside one."""
    match course:
        case Choice(options=inner) | Together(parts=inner):
            return inner
        case Sequence(items=inner) | AnyOrder(items=inner):
            return inner
        case Timed(item=item) | Repeated(item=item) | Counted(item=item) | Conditioned(item=item):
            return (item,)
        case Already(item=item):
            return (item,)
    return ()


def walk(course: Course) -> Iterator[Course]:
    """A course and all courses inside it, in preorder."""
    todo = [course]
    while todo:
        course = todo.pop()
        yield course
        todo += reversed(children(course))


def _within(course: Course, least: int, unlike: type | None = None) -> str:
    """A course as text, in brackets if it binds less tightly than required."""
    text = str(course)
    loose = BINDS.get(type(course), ATOM) < least
    return f"({text})" if loose or (unlike and isinstance(course, unlike)) else text


def _times(n: int) -> str:
    return "time" if n == 1 else "times"

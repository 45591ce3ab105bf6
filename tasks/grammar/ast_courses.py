"""Courses: what stages ask for, as frozen nodes that print themselves back as source.

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
    """`for 5 s`: what precedes it must hold for that long without interruption."""

    duration: Amount
    span: Span = field(default=NOWHERE, compare=False, repr=False)

    def __str__(self) -> str:
        return f"for {self.duration}"


@dataclass(frozen=True, slots=True)
class Deadline:
    """`within 60 s`: what precedes it must be over within that time after it began."""

    duration: Amount
    span: Span = field(default=NOWHERE, compare=False, repr=False)

    def __str__(self) -> str:
        return f"within {self.duration}"


@dataclass(frozen=True, slots=True)
class Delay:
    """`after 10 s to 60 s`: it begins so long after what comes before it is over, no sooner and no later.

    Attributes:
        duration: The least delay.
        most: The greatest, or None when it may begin at any time after the least.
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
        kind: Which of the five.
        condition: What must be seen.
        lasting: How long it must be seen without a break, or None.
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
    """`<approach>`: the stage of that name, here."""

    stage: str
    span: Span = field(default=NOWHERE, compare=False, repr=False)

    def __str__(self) -> str:
        return f"<{self.stage}>"


@dataclass(frozen=True, slots=True)
class Repeated:
    """`a?` (may be left out), `a*` (any number of times), `a+` (at least once)."""

    item: Course
    mark: Literal["?", "*", "+"]
    span: Span = field(default=NOWHERE, compare=False, repr=False)

    def __str__(self) -> str:
        return f"{_within(self.item, ATOM)}{self.mark}"


@dataclass(frozen=True, slots=True)
class Counted:
    """`a at least 2 times at most 5 times`.

    Attributes:
        least: How often at least; 1 when the file does not say, 0 to say that it may be left out.
        most: How often at most, or None.
    """

    item: Course
    least: int = 1
    most: int | None = None
    span: Span = field(default=NOWHERE, compare=False, repr=False)

    def __str__(self) -> str:
        return f"{_within(self.item, CLAUSED, Counted)} {self.times}"

    @property
    def times(self) -> str:
        """How often, as it is written."""
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
        count: How many of them at most; None for all.
        copies: Of what and how many things the items are each one, as `leg` and 4; or None.
        least: How many of them at least; None for as many as at most.
        new: What is another one each time round, as `part`; empty where none is.
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
    """`already a`: done also by what has been so since before its turn."""

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
"""What a stage asks for."""

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
    """A course and all courses inside it, outermost first, in the order of the text."""
    todo = [course]
    while todo:
        course = todo.pop()
        yield course
        todo += reversed(children(course))


def _within(course: Course, least: int, unlike: type | None = None) -> str:
    """A course as text, in brackets when it binds looser than its place asks for."""
    text = str(course)
    loose = BINDS.get(type(course), ATOM) < least
    return f"({text})" if loose or (unlike and isinstance(course, unlike)) else text


def _times(n: int) -> str:
    return "time" if n == 1 else "times"

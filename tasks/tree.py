"""The tree of a task file: frozen nodes that print themselves back as source.

`str(node)` is text of the task language and reads back as the same node; where a node stands in
its file (`span`) takes no part in equality. Spacing, comments and needless brackets are not kept.

Read next: `read.py` (text to tree), `check.py` (what a tree must also satisfy).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Literal, TypeAlias

SECONDS_PER_UNIT = {"ms": 0.001, "s": 1.0, "min": 60.0, "h": 3600.0}


@dataclass(frozen=True, slots=True)
class Span:
    """Where a node stands: lines and columns counted from 1, the end column exclusive."""

    line: int = 0
    column: int = 0
    end_line: int = 0
    end_column: int = 0


NOWHERE = Span()


@dataclass(frozen=True, slots=True)
class Duration:
    """An amount of time with its unit, as written: `60 s`, `2 min`."""

    amount: float
    unit: str = "s"
    span: Span = field(default=NOWHERE, compare=False, repr=False)

    @property
    def seconds(self) -> float:
        """The duration in seconds; an unknown unit counts as seconds (`check` refuses it)."""
        return self.amount * SECONDS_PER_UNIT.get(self.unit, 1.0)

    def __str__(self) -> str:
        return f"{_number(self.amount)} {self.unit}"


@dataclass(frozen=True, slots=True)
class Hold:
    """`for 5 s`: what it stands behind must hold so long without a break."""

    duration: Duration
    span: Span = field(default=NOWHERE, compare=False, repr=False)

    def __str__(self) -> str:
        return f"for {self.duration}"


@dataclass(frozen=True, slots=True)
class Deadline:
    """`within 60 s`: what it stands behind must be over so long after it began."""

    duration: Duration
    span: Span = field(default=NOWHERE, compare=False, repr=False)

    def __str__(self) -> str:
        return f"within {self.duration}"


Clause: TypeAlias = Hold | Deadline


@dataclass(frozen=True, slots=True)
class Name:
    """A name where it is used, such as an actor in an action."""

    text: str
    span: Span = field(default=NOWHERE, compare=False, repr=False)

    def __str__(self) -> str:
        return self.text


@dataclass(frozen=True, slots=True)
class Action:
    """`converging(arm, satellite)`: a relation that should hold between actors."""

    name: str
    actors: tuple[Name, ...]
    span: Span = field(default=NOWHERE, compare=False, repr=False)

    def __str__(self) -> str:
        return f"{self.name}({', '.join(map(str, self.actors))})"


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
class Timed:
    """`a for 5 s within 60 s`: a course with clauses."""

    item: Course
    clauses: tuple[Clause, ...]
    span: Span = field(default=NOWHERE, compare=False, repr=False)

    def __str__(self) -> str:
        return " ".join([_within(self.item, REPEATED), *map(str, self.clauses)])


@dataclass(frozen=True, slots=True)
class Together:
    """`a & b`: at the same time."""

    parts: tuple[Course, ...]
    span: Span = field(default=NOWHERE, compare=False, repr=False)

    def __str__(self) -> str:
        return " & ".join(_within(p, TIMED) for p in self.parts)


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


Course: TypeAlias = Choice | Sequence | Together | Timed | Repeated | Action | Reference
"""What a stage asks for."""

CHOICE, SEQUENCE, TOGETHER, TIMED, REPEATED, ATOM = range(6)
BINDS = {Choice: CHOICE, Sequence: SEQUENCE, Together: TOGETHER, Timed: TIMED, Repeated: REPEATED}


@dataclass(frozen=True, slots=True)
class Actors:
    """The right side of the paper's strict form, `<converging> ::= arm satellite`."""

    names: tuple[Name, ...]
    span: Span = field(default=NOWHERE, compare=False, repr=False)

    def __str__(self) -> str:
        return " ".join(map(str, self.names))


@dataclass(frozen=True, slots=True)
class Stage:
    """A rule: a name and what it stands for.

    Attributes:
        name: The name between the angle brackets.
        body: Its course, or `Actors` when the rule is an action in the strict form.
        span: Where its head stands.
    """

    name: str
    body: Course | Actors
    span: Span = field(default=NOWHERE, compare=False, repr=False)

    def __str__(self) -> str:
        return f"<{self.name}> ::= {self.body}"


@dataclass(frozen=True, slots=True)
class Actor:
    """`actor satellite is spartan201_approx or hubble`: the models that an actor may be."""

    name: str
    models: tuple[str, ...]
    span: Span = field(default=NOWHERE, compare=False, repr=False)

    def __str__(self) -> str:
        return f"actor {self.name} is {' or '.join(self.models)}"


@dataclass(frozen=True, slots=True)
class Invariant:
    """`never touching(arm, radiator)`, `always ... during <approach>`."""

    when: Literal["never", "always"]
    action: Action
    during: Reference | None = None
    span: Span = field(default=NOWHERE, compare=False, repr=False)

    def __str__(self) -> str:
        during = f" during {self.during}" if self.during else ""
        return f"{self.when} {self.action}{during}"


@dataclass(frozen=True, slots=True)
class Task:
    """A task file.

    Attributes:
        stages: Its rules in the order of the file; the first one is the task itself.
        actors: Declarations of actors.
        invariants: What must never or always hold.
        file: Name of the file, for messages.
    """

    stages: tuple[Stage, ...]
    actors: tuple[Actor, ...] = ()
    invariants: tuple[Invariant, ...] = ()
    file: str = field(default="<text>", compare=False)

    @property
    def name(self) -> str:
        """Name of the task, which is that of its first rule."""
        return self.stages[0].name if self.stages else ""

    def stage(self, name: str) -> Stage | None:
        """The first rule of that name, or None."""
        return next((s for s in self.stages if s.name == name), None)

    def models(self, actor: str) -> tuple[str, ...]:
        """Models that an actor may be: as declared, else the one of the actor's own name."""
        return next((a.models for a in self.actors if a.name == actor), (actor,))

    def __str__(self) -> str:
        return "\n".join(map(str, (*self.actors, *self.stages, *self.invariants)))


def children(course: Course) -> tuple[Course, ...]:
    """The courses directly inside one."""
    match course:
        case Choice(options=inner) | Sequence(items=inner) | Together(parts=inner):
            return inner
        case Timed(item=item) | Repeated(item=item):
            return (item,)
    return ()


def walk(course: Course) -> Iterator[Course]:
    """A course and all courses inside it, outermost first, in the order of the text."""
    yield course
    for child in children(course):
        yield from walk(child)


def _within(course: Course, least: int) -> str:
    """A course as text, in brackets when it binds looser than its place asks for."""
    text = str(course)
    return text if BINDS.get(type(course), ATOM) >= least else f"({text})"


def _number(amount: float) -> str:
    return str(int(amount)) if amount == int(amount) and abs(amount) < 1e15 else repr(amount)

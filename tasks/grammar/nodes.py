"""The tree of a task file: frozen nodes that print themselves as source.

`str(node)` is text of the task language that parses to the same node; the position of a node (`span`) does
not affect equality. Spacing, comments and redundant brackets are not preserved.

Read before: `conditions.py` and `ast_courses.py`. Read next: `parser.py` (text to tree).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal, TypeAlias

from visup.rules.formula.nodes import Comparison
from visup.rules.formula.units import NOWHERE, Number, Span, number_text
from visup.tasks.grammar.ast_courses import (
    Already,
    AnyOrder,
    Choice,
    Clause,
    Conditioned,
    Counted,
    Course,
    Deadline,
    Delay,
    Hold,
    Reference,
    Repeated,
    Sequence,
    StageCondition,
    Timed,
    Together,
    children,
    walk,
)
from visup.tasks.grammar.conditions import Action, Amount, Condition, Name, ParameterRef
from visup.tasks.grammar.criteria import Criterion, PartOf, declared_as

__all__ = [
    "NOWHERE",
    "Action",
    "Actor",
    "Actors",
    "Already",
    "Amount",
    "AnyOrder",
    "Choice",
    "Clause",
    "Comparison",
    "Condition",
    "Conditioned",
    "Counted",
    "Course",
    "Deadline",
    "Delay",
    "FloorPoint",
    "Ground",
    "Hold",
    "Include",
    "Invariant",
    "Name",
    "Number",
    "Parameter",
    "ParameterRef",
    "Reference",
    "Repeated",
    "Sequence",
    "Span",
    "Stage",
    "StageCondition",
    "Task",
    "Timed",
    "Together",
    "ZoneDeclaration",
    "children",
    "walk",
]


FloorPoint: TypeAlias = tuple[Number, Number]
"""A position on the floor: two lengths."""


@dataclass(frozen=True, slots=True)
class Actors:
    """The right side of the paper's strict form, `<converging> ::= arm satellite`."""

    names: tuple[Name, ...]
    span: Span = field(default=NOWHERE, compare=False, repr=False)

    def __str__(self) -> str:
        return " ".join(map(str, self.names))


@dataclass(frozen=True, slots=True)
class Stage:
    """A grammar rule: a name and its definition.

    Attributes:
        name: The name between the angle brackets.
        body: Its course, or `Actors` when the rule is an action in the strict form.
        text: Text of the narrative when it begins; empty if the file has none.
        is_task: Whether it is marked with `task`.
        span: Position of its head.
    """

    name: str
    body: Course | Actors
    text: str = ""
    is_task: bool = False
    span: Span = field(default=NOWHERE, compare=False, repr=False)

    def __str__(self) -> str:
        mark, text = "task " if self.is_task else "", f'"{self.text}" ' if self.text else ""
        return f"{mark}<{self.name}> ::= {text}{self.body}"


@dataclass(frozen=True, slots=True)
class Actor:
    """`actor satellite is spartan201_approx or hubble size 1.6 m`, `actor part is the leftmost red`.

    Attributes:
        name: Its name in the file.
        models: The models that it may be; may be empty.
        size: Its largest extent, or None.
        optional: Whether its actions may be left out.
        criteria: Further criteria.
        bystander: Whether it takes no part in the task and is ignored; without a name, all objects that play
            no actor are.
        spare: For a loop with a new actor in each round, the name of that actor: this one is not waited for,
            but its actions may not be left out. Empty for all others.
    """

    name: str
    models: tuple[str, ...] = ()
    size: Amount | None = None
    optional: bool = False
    span: Span = field(default=NOWHERE, compare=False, repr=False)
    criteria: tuple[Criterion, ...] = ()
    bystander: bool = False
    spare: str = ""

    @property
    def machine(self) -> Name | None:
        """The actor of which it is a part, or None."""
        return next((c.machine for c in self.criteria if isinstance(c, PartOf)), None)

    def __str__(self) -> str:
        if self.bystander and not self.name:
            return "bystanders ignored"
        said = "optional actor" if self.optional else "bystander" if self.bystander else "actor"
        size = f"size {self.size}" if self.size else ""
        parts = (said, self.name, declared_as(self.models, self.criteria), size)
        return " ".join(p for p in parts if p)


@dataclass(frozen=True, slots=True)
class ZoneDeclaration:
    """`zone berth is (100, 50) (300, 50) (300, 200)`, `zone yard is (0 m, 0 m) (2 m, 0 m) (2 m, 1 m)`.

    Attributes:
        name: Its name.
        corners: In the image, pixels; none for a zone defined elsewhere, or on the floor.
        floor: Corners on the floor; an object is in such a zone by its foot point.
    """

    name: str
    corners: tuple[tuple[float, float], ...] = ()
    span: Span = field(default=NOWHERE, compare=False, repr=False)
    floor: tuple[FloorPoint, ...] = ()

    def __str__(self) -> str:
        corners = " ".join([*map(_pair, self.corners), *map(_pair, self.floor)])
        return f"zone {self.name}{' is ' + corners if corners else ''}"


@dataclass(frozen=True, slots=True)
class Ground:
    """`ground is (80, 400) = (0 m, 0 m), ...`: corresponding points of the image and the floor.

    Attributes:
        image: (x, y) of each, pixels.
        floor: Their positions on the floor.
    """

    image: tuple[tuple[float, float], ...]
    floor: tuple[FloorPoint, ...]
    span: Span = field(default=NOWHERE, compare=False, repr=False)

    def __str__(self) -> str:
        points = zip(self.image, self.floor, strict=True)
        return f"ground is {', '.join(f'{_pair(i)} = {_pair(f)}' for i, f in points)}"


def _pair(point: FloorPoint | tuple[float, float]) -> str:
    x, y = (p if isinstance(p, Number) else number_text(p) for p in point)
    return f"({x}, {y})"


@dataclass(frozen=True, slots=True)
class Parameter:
    """`parameter patience is 90 s`."""

    name: str
    amount: Amount
    span: Span = field(default=NOWHERE, compare=False, repr=False)

    def __str__(self) -> str:
        return f"parameter {self.name} is {self.amount}"


@dataclass(frozen=True, slots=True)
class Include:
    """`include "common.task"`: the statements of another file, inserted here."""

    path: str
    span: Span = field(default=NOWHERE, compare=False, repr=False)

    def __str__(self) -> str:
        return f'include "{self.path}"'


@dataclass(frozen=True, slots=True)
class Invariant:
    """`never touching(arm, radiator)`, `always ... for 2 s during <approach>`."""

    when: Literal["never", "always"]
    condition: Condition
    lasting: Hold | None = None
    during: tuple[Reference, ...] = ()
    span: Span = field(default=NOWHERE, compare=False, repr=False)

    def __str__(self) -> str:
        lasting = f" {self.lasting}" if self.lasting else ""
        during = f" during {' or '.join(map(str, self.during))}" if self.during else ""
        return f"{self.when} {self.condition}{lasting}{during}"


@dataclass(frozen=True)
class Task:
    """A task file.

    Attributes:
        stages: Its rules in the order of the file.
        actors: Declarations of actors.
        invariants: Invariants (never, always).
        zones: Declarations of zones.
        parameters: Declarations of parameters.
        includes: Included files; their statements are among the others.
        bystanders: Declarations of bystanders.
        grounds: Correspondences of image and floor; more than one is an error.
        file: Name of the file, for messages.
        root: The rule that is the task if the file has several; empty for the first.
        recovered: Stages with a recovery from failure.
    """

    stages: tuple[Stage, ...]
    actors: tuple[Actor, ...] = ()
    invariants: tuple[Invariant, ...] = ()
    zones: tuple[ZoneDeclaration, ...] = ()
    parameters: tuple[Parameter, ...] = ()
    includes: tuple[Include, ...] = ()
    file: str = field(default="<text>", compare=False)
    root: str = ""
    grounds: tuple[Ground, ...] = ()
    bystanders: tuple[Actor, ...] = ()
    recovered: tuple[Reference, ...] = field(default=(), compare=False, repr=False)

    @property
    def ground(self) -> Ground | None:
        """The correspondence of image and floor, or None."""
        return next(iter(self.grounds), None)

    @property
    def declared(self) -> tuple[Actor | ZoneDeclaration | Parameter, ...]:
        """Declarations of actors, bystanders, zones and parameters."""
        bystanders = (b for b in self.bystanders if b.name)
        return (*self.actors, *bystanders, *self.zones, *self.parameters)

    @property
    def roots(self) -> tuple[str, ...]:
        """The tasks of the file: the rules marked with `task`, else the first one."""
        marked = tuple(dict.fromkeys(s.name for s in self.stages if s.is_task))
        return marked or tuple(s.name for s in self.stages[:1])

    @property
    def name(self) -> str:
        """Name of the task."""
        return self.root or next(iter(self.roots), "")

    def stage(self, name: str) -> Stage | None:
        """The first rule of that name, or None."""
        return next((s for s in self.stages if s.name == name), None)

    def actor(self, name: str) -> Actor:
        """The declaration of an actor or bystander."""
        return self._declared.get(name) or Actor(name)

    @cached_property
    def _declared(self) -> dict[str, Actor]:
        """The first declaration of each name; asked for many times per step."""
        return {a.name: a for a in reversed((*self.actors, *self.bystanders))}

    def models(self, actor: str) -> tuple[str, ...]:
        """Models that an actor may be: as declared, else the one of the actor's own name.

        An actor identified only by its looks, place or conduct has no models: it may be any or none.
        """
        declared = self.actor(actor)
        alone = any(not isinstance(c, PartOf) for c in declared.criteria)
        return declared.models or (() if alone else (actor,))

    def amount(self, amount: Amount) -> Number:
        """The value of an amount: itself, or that of its parameter; 0 if undefined."""
        if isinstance(amount, Number):
            return amount
        found = next((p.amount for p in self.parameters if p.name == amount.name), None)
        return found if isinstance(found, Number) else Number(0.0)

    def __str__(self) -> str:
        said = (
            *self.includes,
            *self.parameters,
            *self.actors,
            *self.bystanders,
            *self.grounds,
            *self.zones,
        )
        return "\n".join(map(str, (*said, *self.stages, *self.invariants)))

"""States of a course: what remains of it with its steps under way marked, as frozen values.

Read next: `derivatives.py` (how a course begins, and how it goes on from a state).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Generic, TypeAlias, TypeVar

from visup.agent.model.fast_replace import replace
from visup.tasks.grammar.nodes import Course, StageCondition

W = TypeVar("W")


@dataclass(frozen=True, slots=True)
class RunningDeadline:
    """A `within` that runs.

    Attributes:
        seconds: As written.
        stage: The stage that says it.
        pauses: The pause conditions around it, during which it does not run.
        at: When the time is over, seconds; takes no part in equality, so that two ways to the
            same place are seen to be the same place.
    """

    seconds: float
    stage: str
    at: float = field(compare=False)
    pauses: tuple[StageCondition, ...] = ()


@dataclass(frozen=True, slots=True)
class TaskStep:
    """One action that a course requires.

    Attributes:
        action: Its name; for a comparison or a zone its key (see `structure.fact_key`).
        actors: Who should do it.
        stage: The innermost stage that asks for it.
        hold_s: Seconds for which it must hold, or None when the course does not say.
        deadlines: Each `within` that has the action inside.
        conditions: By what it begins, ends, progresses or fails, where the course says so, one of a kind;
            and by what it is paused, the outermost first.
        inside: Every stage that has the action inside, the innermost with them.
        already: Whether it is done also by what has been so since before its turn.
        delay: Least and greatest time, seconds, from the end of what comes before until it begins, or None.
    """

    action: str
    actors: tuple[str, ...]
    stage: str
    hold_s: float | None = None
    deadlines: tuple[RunningDeadline, ...] = ()
    conditions: tuple[StageCondition, ...] = ()
    inside: frozenset[str] = frozenset()
    already: bool = False
    delay: tuple[float, float] | None = None

    def condition(self, kind: str) -> StageCondition | None:
        """What the course says of how it begins, ends, progresses or fails, or None."""
        return next((s for s in self.conditions if s.kind == kind), None)

    @property
    def pauses(self) -> tuple[StageCondition, ...]:
        """The conditions that pause it, the outermost first."""
        return paused_by(self.conditions)

    @property
    def is_told(self) -> bool:
        """Whether the course says by what it begins, ends, progresses or fails."""
        return len(self.conditions) > len(self.pauses)

    def same_as(self, other: TaskStep) -> bool:
        """Whether both ask the same action of the same actors."""
        return (self.action, self.actors) == (other.action, other.actors)


def paused_by(conditions: tuple[StageCondition, ...]) -> tuple[StageCondition, ...]:
    """Those of some stage conditions that pause."""
    return tuple(c for c in conditions if c.kind == "pauses")


@dataclass(frozen=True, slots=True)
class Leaf(Generic[W]):
    """A step under way, with what its supervisor keeps about it."""

    step: TaskStep
    payload: W


@dataclass(frozen=True, slots=True)
class Continuation:
    """A course not yet begun, with what surrounds it: its stages, its clauses and conditions."""

    course: Course
    stage: str
    hold_s: float | None = None
    deadlines: tuple[RunningDeadline, ...] = ()
    conditions: tuple[StageCondition, ...] = ()
    inside: frozenset[str] = frozenset()
    already: bool = False


@dataclass(frozen=True, slots=True)
class SequenceState(Generic[W]):
    """What is under way, and what comes after it."""

    head: State[W]
    rest: Continuation


@dataclass(frozen=True, slots=True)
class ParallelState(Generic[W]):
    """What is under way at the same time."""

    parts: tuple[State[W], ...]


State: TypeAlias = Leaf[W] | SequenceState[W] | ParallelState[W]


def leaves(state: State[W]) -> tuple[Leaf[W], ...]:
    """The steps under way in a state, in the order of the text."""
    match state:
        case Leaf():
            return (state,)
        case SequenceState(head=head):
            return leaves(head)
        case ParallelState(parts=parts):
            return tuple(leaf for p in parts for leaf in leaves(p))


def depth(state: State[W]) -> int:
    """How deep a state is: 1 for a single step, one more for each course around it."""
    match state:
        case Leaf():
            return 1
        case SequenceState(head=head):
            return 1 + depth(head)
        case ParallelState(parts=parts):
            return 1 + max(depth(p) for p in parts)


def with_leaves(state: State[W], new: Iterator[Leaf[W]]) -> State[W]:
    """The same state with each step under way replaced by the next of `new`."""
    match state:
        case Leaf():
            return next(new)
        case SequenceState(head=head):
            return replace(state, head=with_leaves(head, new))
        case ParallelState(parts=parts):
            return ParallelState(tuple(with_leaves(p, new) for p in parts))


def structural_key(state: State[W]) -> object:
    """What tells two states apart apart from what is kept about their steps; hashable."""
    match state:
        case Leaf(step=step):
            return step
        case SequenceState(head=head, rest=rest):
            return (structural_key(head), rest)
        case ParallelState(parts=parts):
            return frozenset(enumerate(structural_key(p) for p in parts))

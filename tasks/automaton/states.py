"""States of a course: the rest of it with its active steps marked, as frozen values.

Read next: `derivatives.py` (initial and next states of a course).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Generic, TypeAlias, TypeVar

from visup.tasks.grammar.nodes import Course, StageCondition

W = TypeVar("W")


@dataclass(frozen=True, slots=True)
class RunningDeadline:
    """A running `within` clause.

    Attributes:
        seconds: Duration as written.
        stage: The stage that has the clause.
        pauses: The surrounding pause conditions, during which it does not run.
        at: Time when it expires, seconds; excluded from equality, so that two paths to the same state are
            recognised as such.
    """

    seconds: float
    stage: str
    at: float = field(compare=False)
    pauses: tuple[StageCondition, ...] = ()


@dataclass(frozen=True, slots=True)
class TaskStep:
    """One action that a course requires.

    Attributes:
        action: Name of the action; for a comparison or a zone its key (see `structure.fact_key`).
        actors: Its actors.
        stage: The innermost stage that requires it.
        hold_s: Seconds for which it must hold, or None.
        deadlines: Each `within` around the action.
        conditions: At most one condition each by which it begins, ends, progresses or fails; and all pause
            conditions, outermost first.
        inside: All stages around the action, including the innermost.
        already: Whether it is also satisfied if it has held since before its turn.
        delay: (least, greatest) time from the end of its predecessor to its beginning, seconds, or None.
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
        """The condition of a kind (begins, ends, progresses, fails), or None."""
        return next((s for s in self.conditions if s.kind == kind), None)

    @property
    def pauses(self) -> tuple[StageCondition, ...]:
        """Its pause conditions, outermost first."""
        return paused_by(self.conditions)

    @property
    def has_stage_conditions(self) -> bool:
        """Whether the task file states conditions by which it begins, ends, progresses or fails."""
        return len(self.conditions) > len(self.pauses)

    def same_as(self, other: TaskStep) -> bool:
        """Whether both require the same action of the same actors."""
        return (self.action, self.actors) == (other.action, other.actors)


def paused_by(conditions: tuple[StageCondition, ...]) -> tuple[StageCondition, ...]:
    """The pause conditions among stage conditions."""
    return tuple(c for c in conditions if c.kind == "pauses")


@dataclass(frozen=True, slots=True)
class Leaf(Generic[W]):
    """An active step with the supervisor's payload."""

    step: TaskStep
    payload: W


@dataclass(frozen=True, slots=True)
class Continuation:
    """A course not yet begun, with its surrounding stages, clauses and conditions."""

    course: Course
    stage: str
    hold_s: float | None = None
    deadlines: tuple[RunningDeadline, ...] = ()
    conditions: tuple[StageCondition, ...] = ()
    inside: frozenset[str] = frozenset()
    already: bool = False


@dataclass(frozen=True, slots=True)
class SequenceState(Generic[W]):
    """An active state and the course after it."""

    head: State[W]
    rest: Continuation


@dataclass(frozen=True, slots=True)
class ParallelState(Generic[W]):
    """Parallel active states."""

    parts: tuple[State[W], ...]


State: TypeAlias = Leaf[W] | SequenceState[W] | ParallelState[W]


def leaves(state: State[W]) -> tuple[Leaf[W], ...]:
    """The active steps of a state, in the order of the text."""
    # A loop instead of recursion: courses nest deeply, and this is called for each hypothesis in each step.
    while isinstance(state, SequenceState):
        state = state.head
    if isinstance(state, Leaf):
        return (state,)
    return tuple(leaf for p in state.parts for leaf in leaves(p))


def depth(state: State[W]) -> int:
    """Nesting depth of a state: 1 for a single step, one more for each course around it."""
    match state:
        case Leaf():
            return 1
        case SequenceState(head=head):
            return 1 + depth(head)
        case ParallelState(parts=parts):
            return 1 + max(depth(p) for p in parts)


def with_leaves(state: State[W], new: Iterator[Leaf[W]]) -> State[W]:
    """The same state with each active step replaced by the next of `new`."""
    match state:
        case Leaf():
            return next(new)
        case SequenceState(head=head):
            new_head = with_leaves(head, new)
            return state if new_head is head else SequenceState(new_head, state.rest)
        case ParallelState(parts=parts):
            return ParallelState(tuple(with_leaves(p, new) for p in parts))


def structural_key(state: State[W]) -> object:
    """A hashable key that identifies a state apart from its payloads."""
    match state:
        case Leaf(step=step):
            return step
        case SequenceState(head=head, rest=rest):
            return (structural_key(head), rest)
        case ParallelState(parts=parts):
            return frozenset(enumerate(structural_key(p) for p in parts))

"""Where one can be in a course: states, how a course begins, how it goes on.

A state is what remains of a course with its steps under way marked; moving on gives the states
that may come next. It is the derivative of a regular expression, with a stack where stages
are recursive and with several steps under way where a course asks for things at the same time,
so every task of the language has its states, whether or not its language is regular. States
are values: a supervisor may follow as many of them side by side as it likes.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import product
from typing import Generic, TypeAlias, TypeVar

from visup.agent.model.fast_replace import replace
from visup.tasks.grammar.conditions import Fact
from visup.tasks.grammar.nodes import (
    Action,
    Actors,
    AnyOrder,
    Choice,
    Clause,
    Comparison,
    Conditioned,
    Counted,
    Course,
    Hold,
    Reference,
    Repeated,
    Sequence,
    Task,
    Timed,
    Together,
    WhenClause,
)
from visup.tasks.grammar.structure import fact_key
from visup.tasks.grammar.units import value

W = TypeVar("W")
DEEPEST = 200


@dataclass(frozen=True, slots=True)
class Due:
    """A `within` that runs.

    Attributes:
        seconds: As written.
        stage: The stage that says it.
        at: When the time is over, seconds; takes no part in equality, so that two ways to the
            same place are seen to be the same place.
    """

    seconds: float
    stage: str
    at: float = field(compare=False)


@dataclass(frozen=True, slots=True)
class Step:
    """One action that a course asks for.

    Attributes:
        action: Its name; for a comparison or a zone its key (see `structure.keyed`).
        actors: Who should do it.
        stage: The innermost stage that asks for it.
        hold_s: Seconds for which it must hold, or None when the course does not say.
        deadlines: Each `within` that has the action inside.
        signs: By what it begins, ends, progresses or fails, where the course says so; one of a kind.
        inside: Every stage that has the action inside, the innermost with them.
    """

    action: str
    actors: tuple[str, ...]
    stage: str
    hold_s: float | None = None
    deadlines: tuple[Due, ...] = ()
    signs: tuple[WhenClause, ...] = ()
    inside: frozenset[str] = frozenset()

    def sign(self, kind: str) -> WhenClause | None:
        """What the course says of how it begins, ends, progresses or fails, or None."""
        return next((s for s in self.signs if s.kind == kind), None)

    def same_as(self, other: Step) -> bool:
        """Whether both ask the same action of the same actors."""
        return (self.action, self.actors) == (other.action, other.actors)


@dataclass(frozen=True, slots=True)
class Leaf(Generic[W]):
    """A step under way, with what its supervisor keeps about it."""

    step: Step
    watch: W


@dataclass(frozen=True, slots=True)
class Todo:
    """A course not yet begun, with what surrounds it: its stages, its clauses and signs."""

    course: Course
    stage: str
    hold_s: float | None = None
    deadlines: tuple[Due, ...] = ()
    signs: tuple[WhenClause, ...] = ()
    inside: frozenset[str] = frozenset()


@dataclass(frozen=True, slots=True)
class Then(Generic[W]):
    """What is under way, and what comes after it."""

    head: State[W]
    rest: Todo


@dataclass(frozen=True, slots=True)
class Both(Generic[W]):
    """What is under way at the same time."""

    parts: tuple[State[W], ...]


State: TypeAlias = Leaf[W] | Then[W] | Both[W]


@dataclass(frozen=True, slots=True)
class Move(Generic[W]):
    """One way to go on.

    Attributes:
        state: Where it leads, or None for the end of the course.
        left: Steps that are over by it.
        entered: Steps that begin by it.
    """

    state: State[W] | None
    left: tuple[Leaf[W], ...]
    entered: tuple[Leaf[W], ...] = ()


def leaves(state: State[W]) -> tuple[Leaf[W], ...]:
    """The steps under way in a state, in the order of the text."""
    match state:
        case Leaf():
            return (state,)
        case Then(head=head):
            return leaves(head)
        case Both(parts=parts):
            return tuple(leaf for p in parts for leaf in leaves(p))


def nested(state: State[W]) -> int:
    """How deep a state is: 1 for a single step, one more for each course around it."""
    match state:
        case Leaf():
            return 1
        case Then(head=head):
            return 1 + nested(head)
        case Both(parts=parts):
            return 1 + max(nested(p) for p in parts)


def with_leaves(state: State[W], new: Iterator[Leaf[W]]) -> State[W]:
    """The same state with each step under way replaced by the next of `new`."""
    match state:
        case Leaf():
            return next(new)
        case Then(head=head):
            return replace(state, head=with_leaves(head, new))
        case Both(parts=parts):
            return Both(tuple(with_leaves(p, new) for p in parts))


def form(state: State[W]) -> object:
    """What tells two states apart apart from what is kept about their steps; hashable."""
    match state:
        case Leaf(step=step):
            return step
        case Then(head=head, rest=rest):
            return (form(head), rest)
        case Both(parts=parts):
            return frozenset(enumerate(form(p) for p in parts))


def begin(task: Task) -> Todo:
    """The whole task, not yet begun."""
    return Todo(Reference(task.name), task.name)


def enter(
    task: Task, todo: Todo, watch: W, now: float, depth: int = 0
) -> Iterator[State[W] | None]:
    """All ways in which a course can begin.

    Args:
        task: The task whose stages references mean.
        todo: The course.
        watch: What each step starts with.
        now: Seconds, from which each `within` counts.
        depth: How many references were followed without a step; a guard.

    Yields:
        States; None where the course may be left out whole.
    """
    if depth > DEEPEST:
        return
    match todo.course:
        case Action() | Comparison():
            yield from _enter_fact(task, todo, todo.course, watch)
        case Reference(stage=name):
            yield from _enter_stage(task, replace(todo, stage=name), todo.stage, watch, now, depth)
        case Sequence(items=items):
            rest = items[1] if len(items) == 2 else Sequence(items[1:])
            yield from _enter_then(task, todo, items[0], rest, watch, now, depth)
        case Choice(options=options):
            for option in options:
                yield from enter(task, replace(todo, course=option), watch, now, depth)
        case Together(parts=parts):
            yield from _enter_together(task, todo, parts, watch, now, depth)
        case AnyOrder(items=items):
            for i, item in enumerate(items):
                others = (*items[:i], *items[i + 1 :])
                rest = others[0] if len(others) == 1 else AnyOrder(others)
                yield from _enter_then(task, todo, item, rest, watch, now, depth)
        case Timed(item=item, clauses=clauses):
            timed = _timed(task, replace(todo, course=item), clauses, now)
            yield from enter(task, timed, watch, now, depth)
        case Conditioned(item=item, signs=signs):
            kinds = {s.kind for s in signs}
            kept = tuple(s for s in todo.signs if s.kind not in kinds)
            judged = replace(todo, course=item, signs=(*kept, *signs))
            yield from enter(task, judged, watch, now, depth)
        case Counted():
            yield from _enter_counted(task, todo, todo.course, watch, now, depth)
        case Repeated(item=item, mark=mark):
            if mark == "?":
                yield from enter(task, replace(todo, course=item), watch, now, depth)
            else:
                again = Repeated(item, "*")
                yield from _enter_then(task, todo, item, again, watch, now, depth)
            if mark != "+":
                yield None


def moves(task: Task, state: State[W], watch: W, now: float) -> Iterator[Move[W]]:
    """All ways to go on by leaving a step (or, at an end, several at the same time).

    Args:
        task: The task.
        state: Where one is.
        watch: What each entered step starts with.
        now: Seconds, from which each `within` counts.
    """
    match state:
        case Leaf():
            yield Move(None, (state,))
        case Then(head=head, rest=rest):
            for move in moves(task, head, watch, now):
                if move.state is not None:
                    yield replace(move, state=Then(move.state, rest))
                    continue
                for after in enter(task, rest, watch, now):
                    entered = leaves(after) if after is not None else ()
                    yield Move(after, move.left, entered)
        case Both(parts=parts):
            yield from _moves_both(task, parts, watch, now)


def _enter_fact(task: Task, todo: Todo, fact: Fact, watch: W) -> Iterator[State[W] | None]:
    key, actors = fact_key(task, fact)
    step = Step(key, actors, todo.stage, todo.hold_s, todo.deadlines, todo.signs, todo.inside)
    yield Leaf(step, watch)
    if any(task.actor(a).optional for a in actors):
        yield None


def _enter_counted(
    task: Task, todo: Todo, counted: Counted, watch: W, now: float, depth: int
) -> Iterator[State[W] | None]:
    """Once, and after it as often as is left to do."""
    if counted.most == 0:
        yield None
        return
    if counted.most == 1:
        yield from enter(task, replace(todo, course=counted.item), watch, now, depth)
    else:
        most = None if counted.most is None else counted.most - 1
        again = Counted(counted.item, max(0, counted.least - 1), most)
        yield from _enter_then(task, todo, counted.item, again, watch, now, depth)
    if counted.least == 0:
        yield None


def _enter_stage(
    task: Task, todo: Todo, asked_in: str, watch: W, now: float, depth: int
) -> Iterator[State[W] | None]:
    stage = task.stage(todo.stage)
    if stage is None:
        return
    if not isinstance(stage.body, Actors):
        todo = replace(todo, inside=todo.inside | {stage.name})
    if isinstance(stage.body, Actors):
        # An action in the strict form is asked for by the stage that refers to it.
        action = Action(stage.name, stage.body.names)
        yield from enter(task, replace(todo, course=action, stage=asked_in), watch, now, depth + 1)
    else:
        yield from enter(task, replace(todo, course=stage.body), watch, now, depth + 1)


def _enter_then(
    task: Task, todo: Todo, first: Course, rest: Course, watch: W, now: float, depth: int
) -> Iterator[State[W] | None]:
    later = replace(todo, course=rest)
    for state in enter(task, replace(todo, course=first), watch, now, depth):
        if state is None:
            # `first` is left out; a repetition of nothing would never end.
            if not isinstance(rest, Repeated | Counted) or rest.item != first:
                yield from enter(task, later, watch, now, depth)
        else:
            yield Then(state, later)


def _enter_together(
    task: Task, todo: Todo, parts: tuple[Course, ...], watch: W, now: float, depth: int
) -> Iterator[State[W] | None]:
    ways = [tuple(enter(task, replace(todo, course=p), watch, now, depth)) for p in parts]
    for way in product(*ways):
        under_way = tuple(s for s in way if s is not None)
        if not under_way:
            yield None
        else:
            yield under_way[0] if len(under_way) == 1 else Both(under_way)


def _moves_both(task: Task, parts: tuple[State[W], ...], watch: W, now: float) -> Iterator[Move[W]]:
    ends: list[list[Move[W]]] = []
    for i, part in enumerate(parts):
        ends.append([])
        for move in moves(task, part, watch, now):
            if move.state is None:
                ends[-1].append(move)
            else:
                yield replace(move, state=Both((*parts[:i], move.state, *parts[i + 1 :])))
    for together in product(*ends):
        yield Move(None, tuple(leaf for m in together for leaf in m.left))


def _timed(task: Task, todo: Todo, clauses: tuple[Clause, ...], now: float) -> Todo:
    for clause in clauses:
        seconds = value(task.amount(clause.duration))
        if isinstance(clause, Hold):
            todo = replace(todo, hold_s=seconds)
        else:
            due = Due(seconds, todo.stage, now + seconds)
            todo = replace(todo, deadlines=(*todo.deadlines, due))
    return todo

"""States of a course and their derivatives: how it begins and continues.

A state is the rest of a course with its active steps marked; its derivatives are the states that may come
next. This is the derivative of a regular expression, with a stack for recursive stages and several active
steps for parallel courses, so that every task has states, whether or not its language is regular. States are
values: a supervisor can follow any number of them in parallel.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from typing import Generic, TypeVar

from visup.agent.model.fast_replace import replace
from visup.tasks.automaton.states import (
    Continuation,
    Leaf,
    ParallelState,
    RunningDeadline,
    SequenceState,
    State,
    TaskStep,
    leaves,
    paused_by,
    with_leaves,
)
from visup.tasks.grammar.conditions import Fact
from visup.tasks.grammar.nodes import (
    Action,
    Actors,
    Already,
    AnyOrder,
    Choice,
    Clause,
    Comparison,
    Conditioned,
    Counted,
    Course,
    Deadline,
    Delay,
    Hold,
    Reference,
    Repeated,
    Sequence,
    Task,
    Timed,
    Together,
)
from visup.tasks.grammar.structure import fact_key
from visup.tasks.grammar.units import value

W = TypeVar("W")
DEEPEST = 200  # most references followed without a step, against endless recursion


@dataclass(frozen=True, slots=True)
class Derivative(Generic[W]):
    """One derivative of a state.

    Attributes:
        state: The next state, or None for the end of the course.
        left: The steps that it completes.
        entered: The steps that it begins.
    """

    state: State[W] | None
    left: tuple[Leaf[W], ...]
    entered: tuple[Leaf[W], ...] = ()


def begin(task: Task) -> Continuation:
    """The whole task before its beginning."""
    return Continuation(Reference(task.name), task.name)


def enter(
    task: Task, continuation: Continuation, payload: W, now: float
) -> Iterator[State[W] | None]:
    """All initial states of a course.

    Args:
        task: The task that defines the stages.
        continuation: The course.
        payload: Initial payload of each step.
        now: Time from which each `within` counts, seconds.

    Yields:
        States; None if the course may be empty.
    """
    return _Entrance(task, payload, now).states(continuation)


def derivatives(task: Task, state: State[W], payload: W, now: float) -> Iterator[Derivative[W]]:
    """All derivatives of a state by completing a step (or, at an end, several at the same time).

    Args:
        task: The task.
        state: The state.
        payload: Initial payload of each entered step.
        now: Time from which each `within` counts, seconds.
    """
    match state:
        case Leaf():
            yield Derivative(None, (state,))
        case SequenceState(head=head, rest=rest):
            for derivative in derivatives(task, head, payload, now):
                if derivative.state is not None:
                    yield replace(derivative, state=SequenceState(derivative.state, rest))
                    continue
                for after in enter(task, rest, payload, now):
                    entered = leaves(after) if after is not None else ()
                    yield Derivative(after, derivative.left, entered)
        case ParallelState(parts=parts):
            yield from _parallel_derivatives(task, parts, payload, now)


@dataclass(frozen=True, slots=True)
class _Entrance(Generic[W]):
    """Computes the initial states of courses at one moment.

    Attributes:
        task: The task that defines the stages.
        payload: Initial payload of each step.
        now: Time from which each `within` counts, seconds.
        depth: Number of references followed without a step; see `DEEPEST`.
    """

    task: Task
    payload: W
    now: float
    depth: int = 0

    def states(self, todo: Continuation) -> Iterator[State[W] | None]:
        """All initial states of a course; see `enter`."""
        if self.depth > DEEPEST:
            return
        match todo.course:
            case Action() | Comparison() as fact:
                yield from self._fact(todo, fact)
            case Reference(stage=name):
                yield from self._stage(replace(todo, stage=name), todo.stage)
            case Sequence(items=items):
                rest = items[1] if len(items) == 2 else Sequence(items[1:])
                yield from self._in_sequence(todo, items[0], rest)
            case Choice(options=options):
                for option in options:
                    yield from self.states(replace(todo, course=option))
            case Together(parts=parts):
                yield from self._in_parallel(todo, parts)
            case AnyOrder() as any_order:
                yield from self._any_order(todo, any_order)
            case Already(item=item):
                yield from self.states(replace(todo, course=item, already=True))
            case Timed() | Conditioned() as clauses:
                yield from self._clauses(todo, clauses)
            case Counted() as counted:
                yield from self._counted(todo, counted)
            case Repeated() as repeated:
                yield from self._repeated(todo, repeated)

    def _clauses(
        self, todo: Continuation, course: Timed | Conditioned
    ) -> Iterator[State[W] | None]:
        delay = _delay(self.task, course)
        for state in self.states(_surrounded(self.task, todo, course, self.now)):
            yield state if state is None or delay is None else _delayed(state, delay)

    def _fact(self, todo: Continuation, fact: Fact) -> Iterator[State[W] | None]:
        key, actors = fact_key(self.task, fact)
        said = todo.stage, todo.hold_s, todo.deadlines, todo.conditions
        yield Leaf(TaskStep(key, actors, *said, todo.inside, todo.already), self.payload)
        if any(self.task.actor(a).optional for a in actors):
            yield None

    def _stage(self, todo: Continuation, asked_in: str) -> Iterator[State[W] | None]:
        stage = self.task.stage(todo.stage)
        if stage is None:
            return
        deeper = replace(self, depth=self.depth + 1)
        if isinstance(stage.body, Actors):
            # An action in the strict form belongs to the stage that refers to it.
            action = Action(stage.name, stage.body.names)
            yield from deeper.states(replace(todo, course=action, stage=asked_in))
        else:
            inside = todo.inside | {stage.name}
            yield from deeper.states(replace(todo, course=stage.body, inside=inside))

    def _in_sequence(
        self, todo: Continuation, first: Course, rest: Course
    ) -> Iterator[State[W] | None]:
        later = replace(todo, course=rest)
        for state in self.states(replace(todo, course=first)):
            if state is not None:
                yield SequenceState(state, later)
            # `first` is skipped; repeating an empty course would never end.
            elif not isinstance(rest, Repeated | Counted) or rest.item != first:
                yield from self.states(later)

    def _in_parallel(
        self, todo: Continuation, parts: tuple[Course, ...]
    ) -> Iterator[State[W] | None]:
        for way in product(*(tuple(self.states(replace(todo, course=p))) for p in parts)):
            under_way = tuple(s for s in way if s is not None)
            if not under_way:
                yield None
            else:
                yield under_way[0] if len(under_way) == 1 else ParallelState(under_way)

    def _any_order(self, todo: Continuation, course: AnyOrder) -> Iterator[State[W] | None]:
        items = course.items
        left = len(items) if course.count is None else course.count
        least = left if course.least is None else course.least
        for i, item in enumerate(items):
            others = (*items[:i], *items[i + 1 :])
            if left == 1:
                yield from self.states(replace(todo, course=item))
            elif len(others) == 1 and least == 2:
                yield from self._in_sequence(todo, item, others[0])
            else:
                count = None if left - 1 == len(others) else left - 1
                fewest = None if least == left else max(0, least - 1)
                again = AnyOrder(others, count=count, least=fewest, new=course.new)
                yield from self._in_sequence(todo, item, again)
        if least == 0:
            yield None

    def _counted(self, todo: Continuation, counted: Counted) -> Iterator[State[W] | None]:
        """The item once, followed by the remaining repetitions."""
        if counted.most == 0:
            yield None
            return
        if counted.most == 1:
            yield from self.states(replace(todo, course=counted.item))
        else:
            most = None if counted.most is None else counted.most - 1
            again = Counted(counted.item, max(0, counted.least - 1), most)
            yield from self._in_sequence(todo, counted.item, again)
        if counted.least == 0:
            yield None

    def _repeated(self, todo: Continuation, repeated: Repeated) -> Iterator[State[W] | None]:
        if repeated.mark == "?":
            yield from self.states(replace(todo, course=repeated.item))
        else:
            yield from self._in_sequence(todo, repeated.item, Repeated(repeated.item, "*"))
        if repeated.mark != "+":
            yield None


def _parallel_derivatives(
    task: Task, parts: tuple[State[W], ...], payload: W, now: float
) -> Iterator[Derivative[W]]:
    ends: list[list[Derivative[W]]] = []
    for i, part in enumerate(parts):
        ends.append([])
        for derivative in derivatives(task, part, payload, now):
            if derivative.state is None:
                ends[-1].append(derivative)
            else:
                yield replace(
                    derivative, state=ParallelState((*parts[:i], derivative.state, *parts[i + 1 :]))
                )
    for together in product(*ends):
        yield Derivative(None, tuple(leaf for m in together for leaf in m.left))


def _surrounded(
    task: Task, todo: Continuation, course: Timed | Conditioned, now: float
) -> Continuation:
    """The continuation inside clauses or conditions, which apply to each of its steps."""
    todo = replace(todo, course=course.item)
    if isinstance(course, Timed):
        return _timed(task, todo, course.clauses, now)
    kinds = {c.kind for c in course.conditions} - {"pauses"}  # pause conditions accumulate
    outer = tuple(c for c in todo.conditions if c.kind not in kinds)
    return replace(todo, conditions=(*outer, *course.conditions))


def _timed(
    task: Task, continuation: Continuation, clauses: tuple[Clause, ...], now: float
) -> Continuation:
    for clause in clauses:
        seconds = value(task.amount(clause.duration))
        if isinstance(clause, Hold):
            continuation = replace(continuation, hold_s=seconds)
        elif isinstance(clause, Deadline):
            pauses = paused_by(continuation.conditions)
            due = RunningDeadline(seconds, continuation.stage, now + seconds, pauses)
            continuation = replace(continuation, deadlines=(*continuation.deadlines, due))
    return continuation


def _delay(task: Task, course: Timed | Conditioned) -> tuple[float, float] | None:
    """The least and greatest delay of a course, seconds, or None."""
    clauses = course.clauses if isinstance(course, Timed) else ()
    said = next((c for c in clauses if isinstance(c, Delay)), None)
    if said is None:
        return None
    most = math.inf if said.most is None else value(task.amount(said.most))
    return value(task.amount(said.duration)), most


def _delayed(state: State[W], delay: tuple[float, float]) -> State[W]:
    """A state whose steps begin with a delay."""
    delayed = (replace(x, step=replace(x.step, delay=delay)) for x in leaves(state))
    return with_leaves(state, delayed)

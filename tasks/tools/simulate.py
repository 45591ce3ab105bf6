"""Enumerates and samples the legal courses of a task: `visup task simulate`.

A course is a sequence of moments: the active steps between two changes.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from random import Random

from visup.tasks.automaton.derivatives import begin, derivatives, enter
from visup.tasks.automaton.states import (
    ParallelState,
    SequenceState,
    State,
    leaves,
    structural_key,
)
from visup.tasks.grammar.copies import in_turn
from visup.tasks.grammar.nodes import AnyOrder, Task
from visup.tasks.grammar.structure import key_text

LONGEST = 200  # moments after which a random course is cut off
MAX_LOOKED_AT = 50_000  # prefixes of courses explored by an enumeration

Moment = tuple[str, ...]
"""The active steps as text: `<approach> converging(arm, satellite)`."""

Trace = tuple[Moment, ...]


@dataclass(frozen=True, slots=True)
class Position:
    """A position in a task.

    Attributes:
        state: The state of the course; None at the end.
    """

    state: State[None] | None

    @property
    def moment(self) -> Moment:
        """The active steps; empty at the end."""
        return _moment(self.state) if self.state is not None else ()


def initial_positions(task: Task) -> tuple[Position, ...]:
    """The initial positions of a task; including the end if it may be empty.

    Of interchangeable new actors, only the first in order is used, here and in `successors`.
    """
    return _distinct(enter(task, begin(task), None, 0.0))


def successors(task: Task, place: Position) -> tuple[Position, ...]:
    """The possible next positions; none after the end."""
    if place.state is None:
        return ()
    return _distinct(m.state for m in derivatives(task, place.state, None, 0.0))


def traces(task: Task) -> Iterator[Trace]:
    """The courses of a task, each once, shortest first.

    Stops after exploring `MAX_LOOKED_AT` prefixes.
    """
    told: set[Trace] = set()
    looked_at: set[object] = set()
    todo: deque[tuple[Trace, Position]] = deque(((), p) for p in initial_positions(task))
    for _ in range(MAX_LOOKED_AT):
        if not todo:
            return
        before, place = todo.popleft()
        if place.state is None:
            if before not in told:
                told.add(before)
                yield before
        else:
            now = (*before, place.moment)
            for following in successors(task, place):
                key = (now, None if following.state is None else structural_key(following.state))
                if key not in looked_at:  # several paths may lead there
                    looked_at.add(key)
                    todo.append((now, following))


def sample(task: Task, rng: Random) -> tuple[Trace, bool]:
    """A random course, and whether it ended within `LONGEST` moments."""
    place = rng.choice(initial_positions(task))
    course: list[Moment] = []
    while place.state is not None and len(course) < LONGEST:
        course.append(place.moment)
        place = rng.choice(successors(task, place))
    return tuple(course), place.state is None


def _distinct(states: Iterator[State[None] | None]) -> tuple[Position, ...]:
    found: dict[object, Position] = {}
    for state in states:
        if state is None or _in_turn(state):
            found.setdefault(None if state is None else structural_key(state), Position(state))
    return tuple(found.values())


def _in_turn(state: State[None]) -> bool:
    """Whether the new actors of loops have come in order so far."""
    if isinstance(state, SequenceState):
        loop = state.rest.course
        return (not isinstance(loop, AnyOrder) or in_turn(loop)) and _in_turn(state.head)
    return not isinstance(state, ParallelState) or all(map(_in_turn, state.parts))


def _moment(state: State[None]) -> Moment:
    steps = (leaf.step for leaf in leaves(state))
    return tuple(f"<{s.stage}> {key_text(s.action, s.actors)}" for s in steps)

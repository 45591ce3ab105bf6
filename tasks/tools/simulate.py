"""The legal courses of a task, walked, listed and drawn at random: `visup task simulate`.

A course is told as moments: what is under way, from one change to the next.
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

LONGEST = 200  # moments after which a course drawn at random is cut off
MOST_LOOKED_AT = 50_000  # beginnings of courses that a listing looks at

Moment = tuple[str, ...]
"""What is under way at the same time, as text: `<approach> converging(arm, satellite)`."""

Trace = tuple[Moment, ...]


@dataclass(frozen=True, slots=True)
class Position:
    """Where one is in a task.

    Attributes:
        state: What is under way and what remains; None at the end.
    """

    state: State[None] | None

    @property
    def moment(self) -> Moment:
        """What is under way; empty at the end."""
        return _moment(self.state) if self.state is not None else ()


def initial_positions(task: Task) -> tuple[Position, ...]:
    """The places where a task can begin; one at the end when nothing need be seen.

    Of things of which each is a new one, here and in what follows the first comes first.
    """
    return _distinct(enter(task, begin(task), None, 0.0))


def successors(task: Task, place: Position) -> tuple[Position, ...]:
    """The places that can come next; none after the end."""
    if place.state is None:
        return ()
    return _distinct(m.state for m in derivatives(task, place.state, None, 0.0))


def traces(task: Task) -> Iterator[Trace]:
    """The courses of a task, each once, those of few moments first.

    It stops by itself when a task has so many that `MOST_LOOKED_AT` beginnings were looked at.
    """
    told: set[Trace] = set()
    looked_at: set[object] = set()
    todo: deque[tuple[Trace, Position]] = deque(((), p) for p in initial_positions(task))
    for _ in range(MOST_LOOKED_AT):
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
                if key not in looked_at:  # several ways may have led there
                    looked_at.add(key)
                    todo.append((now, following))


def sample(task: Task, rng: Random) -> tuple[Trace, bool]:
    """A course drawn at random, and whether it came to its end within `LONGEST` moments."""
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
    """Whether what is another one each time round came in its order so far."""
    if isinstance(state, SequenceState):
        loop = state.rest.course
        return (not isinstance(loop, AnyOrder) or in_turn(loop)) and _in_turn(state.head)
    return not isinstance(state, ParallelState) or all(map(_in_turn, state.parts))


def _moment(state: State[None]) -> Moment:
    steps = (leaf.step for leaf in leaves(state))
    return tuple(f"<{s.stage}> {key_text(s.action, s.actors)}" for s in steps)

"""The ways on from a state of a course, with what is kept about its steps.

They are worked out once for each node of the automaton. Where a task says `within`, each entry to a
stage has its own time at which it runs out, so that ways on are worked out anew each time.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass

from visup.tasks.automaton.automaton import END, NEW, Automaton, with_payloads
from visup.tasks.automaton.derivatives import (
    Leaf,
    State,
    TaskStep,
    begin,
    derivatives,
    enter,
    leaves,
)
from visup.tasks.grammar.nodes import Actors, Deadline, Task, Timed, walk
from visup.tasks.verification.step_monitor import StepMonitor, entered


@dataclass(frozen=True, slots=True)
class Onward:
    """One way on.

    Attributes:
        left: The steps that are over by it.
        entered: The steps that begin by it.
        share: Its share among the ways that leave the same steps.
        state: Where it leads, with the position of each step that is carried over and `NEW` for
            those that begin; None at the end of the course.
        node: The number of that state, or `END`.
        fresh: Positions of the steps that begin by it.
    """

    left: tuple[Leaf[StepMonitor], ...]
    entered: tuple[TaskStep, ...]
    share: float
    state: State[int] | None
    node: int
    fresh: tuple[int, ...]

    @property
    def ends(self) -> bool:
        """Whether it is the end of the course."""
        return self.state is None


@dataclass(frozen=True, slots=True)
class _Way:
    left: tuple[int, ...]
    entered: tuple[TaskStep, ...]
    share: float
    state: State[int] | None
    node: int
    fresh: tuple[int, ...]


class Paths:
    """The ways on in one task.

    Args:
        task: The task.
        automaton: Its states.
    """

    def __init__(self, task: Task, automaton: Automaton) -> None:
        self._task = task
        self._automaton = automaton
        self._timed = any(_within(task))
        self._known: dict[int, list[_Way]] = {}
        self._starts: list[tuple[State[int], int]] = []

    def begin(self, now: float) -> list[tuple[State[StepMonitor], int]]:
        """The states in which the task may begin now, each with its number."""
        fresh = entered(now)
        return [
            (with_payloads(state, [Leaf(x.step, fresh) for x in leaves(state)]), node)
            for state, node in self._beginnings(now)
        ]

    def first_steps(self) -> Iterator[TaskStep]:
        """The steps with which the task may begin."""
        return (x.step for state, _ in self._beginnings(0.0) for x in leaves(state))

    def _beginnings(self, now: float) -> list[tuple[State[int], int]]:
        if self._starts:
            return self._starts
        states = enter(self._task, begin(self._task), NEW, now)
        found = [(s, self._automaton.node(s)) for s in states if s is not None]
        if not self._timed:
            self._starts = found
        return found

    def onward(self, state: State[StepMonitor], node: int, now: float) -> list[Onward]:
        """All ways on from a state.

        Args:
            state: The state.
            node: Its number.
            now: Seconds, from which each `within` counts.
        """
        transitions = self._known.get(node)
        if transitions is None:
            transitions = self._worked_out(state, now)
            if not self._timed:
                self._known[node] = transitions
        here = leaves(state)
        return [
            Onward(tuple(here[i] for i in w.left), w.entered, w.share, w.state, w.node, w.fresh)
            for w in transitions
        ]

    def taken(
        self, transition: Onward, state: State[StepMonitor], fresh: StepMonitor
    ) -> tuple[State[StepMonitor], int]:
        """Where a way leads that is no end, with what is kept of the steps carried over."""
        assert transition.state is not None
        here = leaves(state)
        new = (
            Leaf(x.step, fresh) if x.payload == NEW else here[x.payload]
            for x in leaves(transition.state)
        )
        return with_payloads(transition.state, list(new)), transition.node

    def _worked_out(self, state: State[StepMonitor], now: float) -> list[_Way]:
        places = iter(range(len(leaves(state))))
        numbered = with_payloads(state, [Leaf(x.step, next(places)) for x in leaves(state)])
        found = []
        for derivative in derivatives(self._task, numbered, NEW, now):
            after = leaves(derivative.state) if derivative.state is not None else ()
            fresh = tuple(i for i, x in enumerate(after) if x.payload == NEW)
            node = END if derivative.state is None else self._automaton.node(derivative.state)
            begun = tuple(after[i].step for i in fresh)
            left = tuple(x.payload for x in derivative.left)
            found.append(_Way(left, begun, 1.0, derivative.state, node, fresh))
        alike = Counter(w.left for w in found)
        return [
            _Way(w.left, w.entered, 1.0 / alike[w.left], w.state, w.node, w.fresh) for w in found
        ]


def _within(task: Task) -> list[Deadline]:
    bodies = [s.body for s in task.stages if not isinstance(s.body, Actors)]
    timed = (c for body in bodies for c in walk(body) if isinstance(c, Timed))
    return [c for t in timed for c in t.clauses if isinstance(c, Deadline)]

"""The states of a course, numbered, each worked out when it is first come to.

A task may have more states than anyone wants to see (any order), or no end of them (recursion),
so nothing is compiled before it is needed. States that are the same (`course.form`) are one node.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from itertools import count
from typing import TypeVar

from visup.tasks.automaton.derivatives import Derivative, begin, derivatives, enter
from visup.tasks.automaton.states import (
    Leaf,
    State,
    TaskStep,
    depth,
    leaves,
    structural_key,
    with_leaves,
)
from visup.tasks.grammar.nodes import Task

V = TypeVar("V")
W = TypeVar("W")
END = -1
"""In place of a node: the course is over."""
TRANSITIONS_PER_NODE = 10
DEEPEST = 60  # courses around a step; each takes some of the depth that Python allows
NEW = -1
"""In place of a step that is carried over: it begins by the way."""


@dataclass(frozen=True, slots=True)
class Transition:
    """One way to go on from a node.

    Attributes:
        target: The node it leads to, or `END`.
        left: Positions of the steps that are over by it.
        carried: For each step of the target its position in the node, or `NEW`.
        share: Its share among the ways that leave the same steps.
    """

    target: int
    left: tuple[int, ...]
    carried: tuple[int, ...]
    share: float

    @property
    def begun(self) -> tuple[int, ...]:
        """Positions in the target of the steps that begin by it."""
        return tuple(i for i, c in enumerate(self.carried) if c == NEW)


class Automaton:
    """The states of a task and the ways between them.

    Args:
        task: The task.
    """

    def __init__(self, task: Task) -> None:
        self._task = task
        self._states: list[State[int]] = []
        self._steps: list[tuple[TaskStep, ...]] = []
        self._numbers: dict[object, int] = {}
        self._ways: dict[int, tuple[Transition, ...]] = {}
        entered = list(enter(task, begin(task), NEW, 0.0))
        self.start = tuple((self._number(s), 1.0 / len(entered)) for s in entered)
        """Nodes in which the task may begin, each with its share; `END` where it may be left out."""

    def __len__(self) -> int:
        return len(self._states)

    def steps(self, node: int) -> tuple[TaskStep, ...]:
        """The steps under way, in the order of the text; none at the end."""
        return () if node == END else self._steps[node]

    def transitions(self, node: int) -> tuple[Transition, ...]:
        """All ways to go on; none at the end."""
        if node == END:
            return ()
        if node not in self._ways:
            self._ways[node] = self._worked_out(node)
        return self._ways[node]

    def node(self, state: State[W]) -> int:
        """The number of a state, whatever is kept about its steps."""
        return self._number(with_payloads(state, [Leaf(x.step, NEW) for x in leaves(state)]))

    def state(self, node: int) -> State[int]:
        """The state of a node; about each step its position is kept."""
        return self._states[node]

    def explored(self, most: int) -> list[int]:
        """The first nodes, breadth first from the start.

        It ends early where ways grow without bound, as they do with stages that come back to
        themselves inside others: so many ways as ten for each node are looked at, and what is
        nested too deep is not gone on from.
        """
        found = {n: None for n, _ in self.start if n != END}
        seen = 0
        for done, node in enumerate(_growing(found)):
            if seen > TRANSITIONS_PER_NODE * most:
                return list(found)[:done]  # the ways of the others are better not worked out
            if depth(self._states[node]) > DEEPEST:
                continue
            seen += len(self.transitions(node))
            for transition in self.transitions(node):
                if transition.target != END and len(found) < most:
                    found.setdefault(transition.target)
        return list(found)

    def _number(self, state: State[int] | None) -> int:
        if state is None:
            return END
        key = structural_key(state)
        if key not in self._numbers:
            self._numbers[key] = len(self._states)
            self._states.append(_numbered(state))
            self._steps.append(tuple(x.step for x in leaves(state)))
        return self._numbers[key]

    def _worked_out(self, node: int) -> tuple[Transition, ...]:
        found = [self._way(m) for m in derivatives(self._task, self._states[node], NEW, 0.0)]
        alike = Counter(w.left for w in found)
        return tuple(replace(w, share=1.0 / alike[w.left]) for w in found)

    def _way(self, derivative: Derivative[int]) -> Transition:
        carried = (
            () if derivative.state is None else tuple(x.payload for x in leaves(derivative.state))
        )
        return Transition(
            self._number(derivative.state), tuple(x.payload for x in derivative.left), carried, 1.0
        )


def with_payloads(state: State[W], new: list[Leaf[V]]) -> State[V]:
    """A state with other things kept about its steps."""
    # The tree is rebuilt from its leaves, so that nothing of the old kind remains in it.
    return with_leaves(state, iter(new))  # type: ignore[arg-type]


def _numbered(state: State[int]) -> State[int]:
    """A state each of whose steps keeps its own position."""
    places = count()
    return with_leaves(state, (replace(x, payload=next(places)) for x in leaves(state)))


def _growing(found: dict[int, None]) -> Iterator[int]:
    """The keys of a dictionary that grows while one goes through them."""
    done = 0
    while done < len(found):
        keys: Iterable[int] = list(found)[done:]
        for key in keys:
            done += 1
            yield key

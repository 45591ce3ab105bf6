"""The automaton of a course: numbered states, computed on demand.

A task may have very many states (any order) or infinitely many (recursion), so nothing is compiled before it
is needed. Structurally equal states (`structural_key`) are one node.
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
"""In place of a node: the end of the course."""
TRANSITIONS_PER_NODE = 10  # most transitions expanded by `explored`, on average per requested node
DEEPEST = 60  # nested courses around a step, limited by Python's recursion depth
NEW = -1
"""In place of a carried step: the step begins with the transition."""


@dataclass(frozen=True, slots=True)
class Transition:
    """A transition from a node.

    Attributes:
        target: The target node, or `END`.
        left: Positions of the steps that it completes.
        carried: For each step of the target its position in the source node, or `NEW`.
        share: Prior probability of this transition among those that complete the same steps.
    """

    target: int
    left: tuple[int, ...]
    carried: tuple[int, ...]
    share: float

    @property
    def begun(self) -> tuple[int, ...]:
        """Positions in the target of the steps that begin with it."""
        return tuple(i for i, c in enumerate(self.carried) if c == NEW)


class Automaton:
    """The states of a task and their transitions.

    Args:
        task: The task.
    """

    def __init__(self, task: Task) -> None:
        self._task = task
        self._states: list[State[int]] = []
        self._steps: list[tuple[TaskStep, ...]] = []
        self._numbers: dict[object, int] = {}
        self._transitions: dict[int, tuple[Transition, ...]] = {}
        entered = list(enter(task, begin(task), NEW, 0.0))
        self.start = tuple((self._number(s), 1.0 / len(entered)) for s in entered)
        """Initial nodes, each with its share; `END` if the task may be empty."""

    def __len__(self) -> int:
        return len(self._states)

    def steps(self, node: int) -> tuple[TaskStep, ...]:
        """The active steps in the order of the text; none at the end."""
        return () if node == END else self._steps[node]

    def transitions(self, node: int) -> tuple[Transition, ...]:
        """All transitions of a node; none at the end."""
        if node == END:
            return ()
        if node not in self._transitions:
            self._transitions[node] = self._computed(node)
        return self._transitions[node]

    def node(self, state: State[W]) -> int:
        """The number of a state, regardless of its payloads."""
        return self._number(with_payloads(state, [Leaf(x.step, NEW) for x in leaves(state)]))

    def state(self, node: int) -> State[int]:
        """The state of a node; the payload of each step is its position."""
        return self._states[node]

    def explored(self, most: int) -> list[int]:
        """The first nodes in breadth-first order.

        Ends early where transitions grow without bound, as with recursive stages inside others: at most
        `TRANSITIONS_PER_NODE` per node are expanded, and no state nested deeper than `DEEPEST`.
        """
        found = {n: None for n, _ in self.start if n != END}
        seen = 0
        for done, node in enumerate(_growing(found)):
            if seen > TRANSITIONS_PER_NODE * most:
                return list(found)[:done]  # do not expand the remaining nodes
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

    def _computed(self, node: int) -> tuple[Transition, ...]:
        found = [self._transition(m) for m in derivatives(self._task, self._states[node], NEW, 0.0)]
        alike = Counter(w.left for w in found)
        return tuple(replace(w, share=1.0 / alike[w.left]) for w in found)

    def _transition(self, derivative: Derivative[int]) -> Transition:
        carried = (
            () if derivative.state is None else tuple(x.payload for x in leaves(derivative.state))
        )
        return Transition(
            self._number(derivative.state), tuple(x.payload for x in derivative.left), carried, 1.0
        )


def with_payloads(state: State[W], new: list[Leaf[V]]) -> State[V]:
    """A state with other payloads of its steps."""
    # The tree is rebuilt from its leaves, so that no payload of the old type remains.
    return with_leaves(state, iter(new))  # type: ignore[arg-type]


def _numbered(state: State[int]) -> State[int]:
    """A state with the position of each step as its payload."""
    places = count()
    return with_leaves(state, (replace(x, payload=next(places)) for x in leaves(state)))


def _growing(found: dict[int, None]) -> Iterator[int]:
    """Iterate over the keys of a dictionary that grows meanwhile."""
    done = 0
    while done < len(found):
        keys: Iterable[int] = list(found)[done:]
        for key in keys:
            done += 1
            yield key

"""Detects steps done before their prerequisites: a cap put on a base that still lacks its block.

That the prerequisites were not observed is no proof, since they may have been missed. A step is therefore out
of turn only if every path to it leads through a step that is known not to hold.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator

from visup.tasks.automaton.automaton import END, Automaton
from visup.tasks.automaton.states import TaskStep

MAX_NODES = 200
"""Most nodes that are searched: of a task with very many states only the next ones are judged."""


def later_steps(automaton: Automaton, nodes: Iterable[int]) -> tuple[TaskStep, ...]:
    """The steps of some nodes and of all nodes that can be reached from them, each once, nearest first."""
    return tuple(dict.fromkeys(_reached(automaton, nodes, lambda _: True)))


def out_of_turn(
    automaton: Automaton,
    nodes: Collection[int],
    steps: Iterable[TaskStep],
    lacks: Callable[[TaskStep], bool],
) -> tuple[TaskStep, TaskStep] | None:
    """The first of some steps to which every path leads through a lacking one.

    Args:
        automaton: The states of the course.
        nodes: Numbers of the states that may be the present one.
        steps: Steps that hold now.
        lacks: Whether a step is known not to hold, and has not held in its turn.

    Returns:
        That step, and the first lacking one; None if there is no such step.
    """
    held = list(steps)
    if not held:
        return None
    allowed = set(_reached(automaton, nodes, lambda s: not lacks(s)))
    found = next((s for s in held if s not in allowed), None)
    lacking = (s for s in later_steps(automaton, nodes) if lacks(s))
    return None if found is None else (found, next(lacking))


def _reached(
    automaton: Automaton, nodes: Iterable[int], passes: Callable[[TaskStep], bool]
) -> Iterator[TaskStep]:
    """The steps of some nodes, and of all that follow by completing only steps that can be passed."""
    ahead = list(nodes)
    found = set(ahead)
    for current in ahead:
        steps = automaton.steps(current)
        yield from steps
        if len(found) >= MAX_NODES:
            continue
        for transition in automaton.transitions(current):
            free = all(passes(steps[i]) for i in transition.left)
            if free and transition.target != END and transition.target not in found:
                found.add(transition.target)
                ahead.append(transition.target)

"""Language comparison of two tasks: by the courses that they accept, not by their text.

Both automata are determinised in a product construction; the shortest course accepted by only one of them is
the difference, rendered in words. Everything else (times, conditions, actors and so on) is compared as text.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import NamedTuple, TypeVar

from visup.tasks.automaton.automaton import END, Automaton
from visup.tasks.automaton.states import TaskStep
from visup.tasks.grammar.conditions import action_of, facts_of
from visup.tasks.grammar.nodes import (
    Action,
    Actors,
    Already,
    Comparison,
    Conditioned,
    Task,
    Timed,
    walk,
)
from visup.tasks.grammar.nodes import (
    Course as Asked,
)
from visup.tasks.grammar.structure import key_text

C = TypeVar("C")

MAX_STATES = 4_000
"""Larger product automata are compared up to this many states only."""

Label = frozenset[tuple[str, frozenset[str]]]
"""Actions that begin together, each with its actors."""
Course = tuple[Label, ...]
Nodes = frozenset[int]


@dataclass(frozen=True, slots=True)
class TaskDifference:
    """The difference between two tasks.

    Attributes:
        only_first: The shortest course that only the first accepts, or None.
        only_second: The shortest that only the second accepts, or None.
        other: Other differences: whether only the first task has it, what, and the aspect.
        whole: Whether all courses were compared, not only those up to some length.
    """

    only_first: Course | None
    only_second: Course | None
    other: tuple[tuple[bool, str, str], ...]
    whole: bool

    def __bool__(self) -> bool:
        return self.only_first is not None or self.only_second is not None or bool(self.other)

    def lines(self, first: str, second: str) -> Iterator[str]:
        """The difference in words.

        Args:
            first: Name of the first task.
            second: Name of the second.
        """
        for course, one, two in (
            (self.only_first, first, second),
            (self.only_second, second, first),
        ):
            if course is not None:
                yield f"only {one} allows: {course_text(course)}; {two} does not"
        if self.only_first is None and self.only_second is None:
            yield "both allow the same courses" + (
                "" if self.whole else ", as far as they were compared"
            )
        for of_first, what, aspect in self.other:
            yield f"only {first if of_first else second} has {what} ({aspect})"


class _Pair(NamedTuple):
    first: Nodes
    second: Nodes


def difference(first: Task, second: Task) -> TaskDifference:
    """The difference between two tasks.

    Args:
        first: A checked task.
        second: A checked task.
    """
    only_first, only_second, whole = _courses(Automaton(first), Automaton(second))
    return TaskDifference(only_first, only_second, tuple(_other(first, second)), whole)


def _courses(one: Automaton, two: Automaton) -> tuple[Course | None, Course | None, bool]:
    """The shortest course of each that the other does not accept; whether all were compared."""
    start = _Pair(frozenset([START]), frozenset([START]))
    todo: list[tuple[_Pair, Course]] = [(start, ())]
    seen = {start}
    found: list[Course | None] = [None, None]
    while todo and len(seen) < MAX_STATES and None in found:
        pair, course = todo.pop(0)
        ends = _ends(one, pair.first), _ends(two, pair.second)
        for side in (0, 1):
            if ends[side] and not ends[1 - side] and found[side] is None:
                found[side] = course
        successors = _successors(one, pair.first), _successors(two, pair.second)
        for label in sorted({*successors[0], *successors[1]}, key=label_text):
            new = _Pair(successors[0].get(label, NOWHERE), successors[1].get(label, NOWHERE))
            if new not in seen:
                seen.add(new)
                todo.append((new, (*course, label)))
    return found[0], found[1], not todo


START = -2
"""Stands for a node: nothing has begun."""
NOWHERE: Nodes = frozenset()


def _successors(automaton: Automaton, nodes: Nodes) -> dict[Label, Nodes]:
    """Successor node sets by label."""
    found: dict[Label, set[int]] = {}
    for label, target in _begun(automaton, nodes):
        found.setdefault(label, set()).add(target)
    return {label: _epsilon_closure(automaton, targets) for label, targets in found.items()}


def _begun(automaton: Automaton, nodes: Nodes) -> Iterator[tuple[Label, int]]:
    for node in nodes:
        if node == START:
            yield from ((_label(automaton.steps(n)), n) for n, _ in automaton.start if n != END)
            continue
        for transition in automaton.transitions(node):
            if transition.begun:
                steps = automaton.steps(transition.target)
                yield _label(tuple(steps[k] for k in transition.begun)), transition.target


def _epsilon_closure(automaton: Automaton, nodes: set[int]) -> Nodes:
    """The closure of some nodes under transitions that begin no step (epsilon closure)."""
    todo, found = list(nodes), set(nodes)
    while todo:
        for transition in automaton.transitions(todo.pop()):
            target = transition.target
            if not transition.begun and target not in found:
                found.add(target)
                todo += [target] if target != END else []
    return frozenset(found)


def _ends(automaton: Automaton, nodes: Nodes) -> bool:
    """Whether a set of nodes is accepting."""
    over = START in nodes and any(n == END for n, _ in automaton.start)
    return over or END in nodes


def _label(steps: tuple[TaskStep, ...]) -> Label:
    return frozenset((s.action, frozenset(s.actors)) for s in steps)


def course_text(course: Course) -> str:
    """A course in words: `converging(arm, satellite), then coupled(arm, satellite)`."""
    if not course:
        return "nothing at all"
    return ", then ".join(map(label_text, course))


def label_text(label: Label) -> str:
    """A label in words."""
    return " & ".join(sorted(key_text(action, sorted(who)) for action, who in label))


def _other(first: Task, second: Task) -> Iterator[tuple[bool, str, str]]:
    for what, of in OTHER:
        one, two = of(first), of(second)
        yield from ((True, missing, what) for missing in sorted(one - two))
        yield from ((False, missing, what) for missing in sorted(two - one))


ActorsAction = tuple[str, frozenset[str]]
"""An action and its actors, in any order."""


def actions_of(task: Task) -> set[ActorsAction]:
    """The actions and comparisons that a task asks for, in whatever order, with their actors."""
    facts = (f for course in _courses_of(task) for f in _facts(course))
    return {(a.name, frozenset(map(str, a.arguments))) for a in map(action_of, facts)}


def _facts(course: Asked) -> Iterator[Action | Comparison]:
    if isinstance(course, Action | Comparison):
        yield course
    elif isinstance(course, Conditioned):
        yield from (f for s in course.conditions for f in facts_of(s.condition))


def _asked(task: Task) -> set[str]:
    return {f"`{key_text(name, sorted(actors))}`" for name, actors in actions_of(task)}


def _invariants(task: Task) -> set[str]:
    return {str(i) for i in task.invariants}


def _declared(task: Task) -> set[str]:
    return {str(a) for a in (*task.actors, *task.bystanders)}


def _times(task: Task) -> set[str]:
    """Each time clause with the course that it qualifies."""
    return {f"`{c}`" for c in _all(task, Timed)}


def _conditions(task: Task) -> set[str]:
    """Each stage condition with the course that it qualifies, and each `already`."""
    found = (f"`{c.item} {each}`" for c in _all(task, Conditioned) for each in c.conditions)
    return {*found, *(f"`{c}`" for c in _all(task, Already))}


def _places(task: Task) -> set[str]:
    """Zones, and the floor."""
    return {f"`{place}`" for place in (*task.zones, *task.grounds)}


def _all(task: Task, kind: type[C]) -> Iterator[C]:
    """Every course of a kind."""
    return (c for c in _courses_of(task) if isinstance(c, kind))


def _courses_of(task: Task) -> Iterator[Asked]:
    """Every course of a task, and those within it."""
    return (c for s in task.stages if not isinstance(s.body, Actors) for c in walk(s.body))


OTHER: tuple[tuple[str, Callable[[Task], set[str]]], ...] = (
    ("actions", _asked),
    ("invariants", _invariants),
    ("times", _times),
    ("conditions", _conditions),
    ("actors", _declared),
    ("places", _places),
)
"""Other aspects that are compared, by name."""

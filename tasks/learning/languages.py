"""How two tasks differ: by the courses that they allow, not by how they are written.

Both automata are made deterministic side by side; the shortest course that one allows and the other
does not is the difference, told in words. What is no matter of courses (times, conditions, actors and so on)
is compared by what it says.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import NamedTuple, TypeVar

from visup.tasks.automaton.automaton import END, Automaton
from visup.tasks.automaton.states import TaskStep
from visup.tasks.grammar.nodes import Actors, Already, Conditioned, Task, Timed, walk
from visup.tasks.grammar.structure import key_text

C = TypeVar("C")

MOST_STATES = 4_000
"""Tasks with more are compared up to so many."""

Label = frozenset[tuple[str, frozenset[str]]]
"""What begins together: each action with its actors."""
Course = tuple[Label, ...]
Nodes = frozenset[int]


@dataclass(frozen=True, slots=True)
class TaskDifference:
    """How two tasks differ.

    Attributes:
        only_first: The shortest course that only the first allows, or None.
        only_second: The shortest that only the second allows, or None.
        other: What else differs, a clause each.
        whole: Whether all courses were compared, and not those up to some length.
    """

    only_first: Course | None
    only_second: Course | None
    other: tuple[str, ...]
    whole: bool

    def __bool__(self) -> bool:
        return self.only_first is not None or self.only_second is not None or bool(self.other)

    def lines(self, first: str, second: str) -> Iterator[str]:
        """The difference in words.

        Args:
            first: What the first task is called.
            second: What the second is called.
        """
        for course, one, two in (
            (self.only_first, first, second),
            (self.only_second, second, first),
        ):
            if course is not None:
                yield f"only {one} allows: {told(course)}; {two} does not"
        if self.only_first is None and self.only_second is None:
            yield "both allow the same courses" + (
                "" if self.whole else ", as far as they were compared"
            )
        yield from self.other


class _Pair(NamedTuple):
    first: Nodes
    second: Nodes


def difference(first: Task, second: Task) -> TaskDifference:
    """How two tasks differ.

    Args:
        first: Checked.
        second: Checked.
    """
    only_first, only_second, whole = _courses(Automaton(first), Automaton(second))
    return TaskDifference(only_first, only_second, tuple(_other(first, second)), whole)


def _courses(one: Automaton, two: Automaton) -> tuple[Course | None, Course | None, bool]:
    """The shortest course of each that the other does not allow; whether all were compared."""
    start = _Pair(frozenset([START]), frozenset([START]))
    todo: list[tuple[_Pair, Course]] = [(start, ())]
    seen = {start}
    found: list[Course | None] = [None, None]
    while todo and len(seen) < MOST_STATES and None in found:
        pair, course = todo.pop(0)
        ends = _ends(one, pair.first), _ends(two, pair.second)
        for side in (0, 1):
            if ends[side] and not ends[1 - side] and found[side] is None:
                found[side] = course
        ways = _ways(one, pair.first), _ways(two, pair.second)
        for label in sorted({*ways[0], *ways[1]}, key=told_label):
            new = _Pair(ways[0].get(label, NOWHERE), ways[1].get(label, NOWHERE))
            if new not in seen:
                seen.add(new)
                todo.append((new, (*course, label)))
    return found[0], found[1], not todo


START = -2
"""In place of a node: nothing has begun."""
NOWHERE: Nodes = frozenset()


def _ways(automaton: Automaton, nodes: Nodes) -> dict[Label, Nodes]:
    """What may begin next, and where that leads."""
    found: dict[Label, set[int]] = {}
    for label, target in _begun(automaton, nodes):
        found.setdefault(label, set()).add(target)
    return {label: _closed(automaton, targets) for label, targets in found.items()}


def _begun(automaton: Automaton, nodes: Nodes) -> Iterator[tuple[Label, int]]:
    for node in nodes:
        if node == START:
            yield from ((_label(automaton.steps(n)), n) for n, _ in automaton.start if n != END)
            continue
        for transition in automaton.transitions(node):
            if transition.begun:
                steps = automaton.steps(transition.target)
                yield _label(tuple(steps[k] for k in transition.begun)), transition.target


def _closed(automaton: Automaton, nodes: set[int]) -> Nodes:
    """With all nodes that are come to without that anything begins."""
    todo, found = list(nodes), set(nodes)
    while todo:
        for transition in automaton.transitions(todo.pop()):
            target = transition.target
            if not transition.begun and target not in found:
                found.add(target)
                todo += [target] if target != END else []
    return frozenset(found)


def _ends(automaton: Automaton, nodes: Nodes) -> bool:
    """Whether the course may be over at one of some nodes."""
    over = START in nodes and any(n == END for n, _ in automaton.start)
    return over or END in nodes


def _label(steps: tuple[TaskStep, ...]) -> Label:
    return frozenset((s.action, frozenset(s.actors)) for s in steps)


def told(course: Course) -> str:
    """A course in words: `converging(arm, satellite), then coupled(arm, satellite)`."""
    if not course:
        return "nothing at all"
    return ", then ".join(map(told_label, course))


def told_label(label: Label) -> str:
    """What begins together in words."""
    return " & ".join(sorted(key_text(action, sorted(who)) for action, who in label))


def _other(first: Task, second: Task) -> Iterator[str]:
    for what, of in OTHER:
        one, two = of(first), of(second)
        for missing in sorted(one - two):
            yield f"only the first has {missing} ({what})"
        for missing in sorted(two - one):
            yield f"only the second has {missing} ({what})"


def _invariants(task: Task) -> set[str]:
    return {str(i) for i in task.invariants}


def _declared(task: Task) -> set[str]:
    return {str(a) for a in (*task.actors, *task.bystanders)}


def _times(task: Task) -> set[str]:
    """Each clause with what it stands behind."""
    return {f"`{c}`" for c in _all(task, Timed)}


def _conditions(task: Task) -> set[str]:
    """Each stage condition with what it stands behind, and what may have been so already."""
    said = (f"`{c.item} {told}`" for c in _all(task, Conditioned) for told in c.conditions)
    return {*said, *(f"`{c}`" for c in _all(task, Already))}


def _places(task: Task) -> set[str]:
    """Zones, and the floor."""
    return {f"`{place}`" for place in (*task.zones, *task.grounds)}


def _all(task: Task, kind: type[C]) -> Iterator[C]:
    """Every course of a kind."""
    bodies = [s.body for s in task.stages if not isinstance(s.body, Actors)]
    return (c for b in bodies for c in walk(b) if isinstance(c, kind))


OTHER: tuple[tuple[str, Callable[[Task], set[str]]], ...] = (
    ("invariants", _invariants),
    ("times", _times),
    ("conditions", _conditions),
    ("actors", _declared),
    ("places", _places),
)
"""What differs besides courses, and how it is said."""

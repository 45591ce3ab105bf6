"""Analysis of a grammar: reachability, nullability, termination, and least durations.

Each analysis takes time linear in the size of the file: stages are processed after those that they refer to,
and only cycles are iterated.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import cached_property

from visup.tasks.grammar.conditions import Fact, action_of
from visup.tasks.grammar.graphs import cycles, dependencies_first, reachable
from visup.tasks.grammar.nodes import (
    Action,
    Actors,
    Already,
    AnyOrder,
    Choice,
    Comparison,
    Conditioned,
    Counted,
    Course,
    Hold,
    Reference,
    Repeated,
    Sequence,
    Stage,
    Task,
    Timed,
    Together,
    walk,
)
from visup.tasks.grammar.units import value

NEVER = float("inf")


class Grammar:
    """Analyses of the grammar of a task; undefined stages count as terminating and take no time.

    Args:
        task: The task, with at least one rule.
    """

    def __init__(self, task: Task) -> None:
        self.task = task
        self.stages: dict[str, Stage] = {}
        for stage in task.stages:
            self.stages.setdefault(stage.name, stage)
        self._optional = {a.name for a in task.actors if a.optional}

    @cached_property
    def asked(self) -> list[tuple[str, Fact]]:
        """Every required action and comparison with the name of its stage."""
        found = []
        for stage in self.stages.values():
            if isinstance(stage.body, Actors):
                continue
            for course in walk(stage.body):
                fact = self._as_fact(course)
                if fact is not None:
                    found.append((stage.name, fact))
        return found

    @cached_property
    def mentions(self) -> Mapping[str, tuple[str, ...]]:
        """Stage -> the stages that it refers to, in the order of the text."""
        return {name: self._mentions(stage) for name, stage in self.stages.items()}

    @cached_property
    def reached(self) -> frozenset[str]:
        """Stages reachable from the tasks of the file, including these."""
        return reachable(self.mentions, [r for r in self.task.roots if r in self.stages])

    def unreachable(self) -> list[Stage]:
        """Unreachable stages; of a cycle only the first."""
        lost = [s for s in self.stages.values() if s.name not in self.reached]
        named = {n for s in lost for n in self.mentions[s.name] if n != s.name}
        roots = [s for s in lost if s.name not in named]
        return roots or lost[:1]

    def nullable(self, course: Course) -> bool:
        """Whether a course may be empty."""
        return self._empty(course, self._empty_stages)

    def left_recursive(self) -> list[Stage]:
        """Stages that lead to themselves before any action; of each cycle only the first."""
        order = {name: i for i, name in enumerate(self.stages)}
        firsts = {name: tuple(self._first_of(stage)) for name, stage in self.stages.items()}
        found = [min(circle, key=order.__getitem__) for circle in cycles(firsts)]
        return [self.stages[n] for n in sorted(found, key=order.__getitem__)]

    def non_terminating(self) -> list[Stage]:
        """Stages that cannot terminate; only the first."""
        lasting = [s for n, s in self.stages.items() if self._least_times[n] == NEVER]
        named = {n for s in lasting for n in self.mentions[s.name]}
        own = [s for s in lasting if s.name in named]
        return (own or lasting)[:1]

    def min_duration(self, course: Course) -> float:
        """Least duration of a course by its `for` clauses, seconds."""
        return self._least(course, self._least_times)

    def is_sequential(self, course: Course) -> bool:
        """Whether a course has parts that follow one another."""
        return self._has_turns(walk(course), self._turning)

    def sole_fact(self, course: Course) -> Fact | None:
        """The action or comparison of a course that requires only one, or None."""
        seen = set()
        while True:
            match course:
                case Timed(item=item) | Conditioned(item=item):
                    course = item
                case Reference(stage=name):
                    fact = self._as_fact(course)
                    stage = self.stages.get(name)
                    if fact is not None or stage is None or name in seen:
                        return fact
                    if isinstance(stage.body, Actors):
                        return fact
                    seen.add(name)
                    course = stage.body
                case _:
                    return self._as_fact(course)

    def _as_fact(self, course: Course) -> Fact | None:
        """A fact, or the action of a reference in the strict form."""
        if isinstance(course, Action | Comparison):
            return course
        if isinstance(course, Reference):
            stage = self.stages.get(course.stage)
            if stage is not None and isinstance(stage.body, Actors):
                return Action(stage.name, stage.body.names, course.span)
        return None

    def _mentions(self, stage: Stage) -> tuple[str, ...]:
        if isinstance(stage.body, Actors):
            return ()
        named = (c.stage for c in walk(stage.body) if isinstance(c, Reference))
        return tuple(dict.fromkeys(n for n in named if n in self.stages))

    @cached_property
    def _bottom_up(self) -> list[tuple[str, Course]]:
        """Stages with a course, each after those that it refers to, apart from cycles."""
        named = ((n, self.stages[n].body) for n in dependencies_first(self.mentions))
        return [(n, body) for n, body in named if not isinstance(body, Actors)]

    @cached_property
    def _empty_stages(self) -> set[str]:
        empty: set[str] = set()
        while True:
            before = len(empty)
            for name, body in self._bottom_up:
                if name not in empty and self._empty(body, empty):
                    empty.add(name)
            if len(empty) == before:
                return empty

    def _empty(self, course: Course, stages: set[str]) -> bool:
        match course:
            case Reference(stage=name):
                fact = self._as_fact(course)
                return name in stages if fact is None else self._empty(fact, stages)
            case Action() | Comparison():
                return any(a in self._optional for a in action_of(course).arguments)
            case Choice(options=options):
                return any(self._empty(o, stages) for o in options)
            case AnyOrder(least=0):
                return True
            case Sequence(items=parts) | Together(parts=parts) | AnyOrder(items=parts):
                return all(self._empty(p, stages) for p in parts)
            case Timed(item=item) | Conditioned(item=item) | Already(item=item):
                return self._empty(item, stages)
            case Repeated(item=item, mark=mark):
                return mark != "+" or self._empty(item, stages)
            case Counted(item=item, least=least):
                return least == 0 or self._empty(item, stages)

    def _first_of(self, stage: Stage) -> set[str]:
        return set() if isinstance(stage.body, Actors) else set(self._first(stage.body))

    def _first(self, course: Course) -> Iterable[str]:
        """Stages that a course may lead to before any action."""
        match course:
            case Reference(stage=name):
                return [name] if name in self.stages else []
            case Choice(options=parts) | Together(parts=parts) | AnyOrder(items=parts):
                return [n for p in parts for n in self._first(p)]
            case (
                Timed(item=item)
                | Repeated(item=item)
                | Counted(item=item)
                | Conditioned(item=item)
                | Already(item=item)
            ):
                return self._first(item)
            case Sequence(items=items):
                found: list[str] = []
                for item in items:
                    found += self._first(item)
                    if not self.nullable(item):
                        break
                return found
        return []

    @cached_property
    def _least_times(self) -> dict[str, float]:
        """Least duration of each stage, seconds, by relaxation as in shortest paths."""
        times = dict.fromkeys(self.stages, NEVER)
        times |= {n: 0.0 for n, s in self.stages.items() if isinstance(s.body, Actors)}
        for _ in range(len(times) + 1):
            changed = False
            for name, body in self._bottom_up:
                least = self._least(body, times)
                changed = changed or least != times[name]
                times[name] = least
            if not changed:
                break
        return times

    def _least(self, course: Course, times: dict[str, float]) -> float:
        match course:
            case Reference(stage=name):
                return times.get(name, 0.0)
            case Choice(options=options):
                return min(self._least(o, times) for o in options)
            case AnyOrder(items=items, least=int(count)) | AnyOrder(items=items, count=int(count)):
                return sum(sorted(self._least(i, times) for i in items)[:count])
            case Sequence(items=items) | AnyOrder(items=items):
                return sum(self._least(i, times) for i in items)
            case Together(parts=parts):
                return max(self._least(p, times) for p in parts)
            case Repeated(item=item, mark=mark):
                return self._least(item, times) if mark == "+" else 0.0
            case Counted(item=item, least=least):
                return least * self._least(item, times) if least else 0.0
            case Conditioned(item=item) | Already(item=item):
                return self._least(item, times)
            case Timed(item=item, clauses=clauses):
                amounts = (self.task.amount(c.duration) for c in clauses if isinstance(c, Hold))
                return max(self._least(item, times), *map(value, amounts), 0.0)
        return 0.0

    @cached_property
    def _turning(self) -> frozenset[str]:
        """Stages with parts that follow one another."""
        users: dict[str, list[str]] = {}
        for name, named in self.mentions.items():
            for other in named:
                users.setdefault(other, []).append(name)
        bodies = ((n, s.body) for n, s in self.stages.items())
        own = [
            n
            for n, body in bodies
            if not isinstance(body, Actors) and self._has_turns(walk(body), frozenset())
        ]
        return reachable({n: tuple(users.get(n, ())) for n in self.stages}, own)

    def _has_turns(self, courses: Iterable[Course], turning: frozenset[str]) -> bool:
        return any(
            isinstance(c, Sequence | Repeated | Counted | AnyOrder)
            or (isinstance(c, Reference) and c.stage in turning)
            for c in courses
        )

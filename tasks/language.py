"""What a grammar says as a whole: what is reached, what may be left out, what can end, how soon."""

from __future__ import annotations

from functools import cached_property

from visup.tasks.tree import (
    Action,
    Actors,
    Choice,
    Course,
    Deadline,
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

NEVER = float("inf")


class Grammar:
    """Questions about the grammar of a task; stages that are not defined take no time and end.

    Args:
        task: The task, with at least one rule.
    """

    def __init__(self, task: Task) -> None:
        self.task = task
        self.stages: dict[str, Stage] = {}
        for stage in task.stages:
            self.stages.setdefault(stage.name, stage)

    @cached_property
    def asked(self) -> list[tuple[str, Action]]:
        """Every action that a stage asks for, with the name of the stage."""
        found = []
        for stage in self.stages.values():
            if isinstance(stage.body, Actors):
                continue
            for course in walk(stage.body):
                action = self._as_action(course)
                if action is not None:
                    found.append((stage.name, action))
        return found

    @cached_property
    def reached(self) -> frozenset[str]:
        """Stages that the task can come to, itself with them."""
        seen: set[str] = set()
        todo = [self.task.name]
        while todo:
            name = todo.pop()
            if name not in seen and name in self.stages:
                seen.add(name)
                todo += self._mentions(name)
        return frozenset(seen)

    def unreached(self) -> list[Stage]:
        """Stages that the task never comes to; of those that lead to each other only the first."""
        lost = [s for s in self.stages.values() if s.name not in self.reached]
        named = {n for s in lost for n in self._mentions(s.name) if n != s.name}
        roots = [s for s in lost if s.name not in named]
        return roots or lost[:1]

    def may_be_left_out(self, course: Course) -> bool:
        """Whether nothing need be seen of a course."""
        return self._empty(course, self._empty_stages)

    def begin_with_themselves(self) -> list[Stage]:
        """Stages that come to themselves before any action; of each circle only the first."""
        first = {name: self._first_of(name) for name in self.stages}
        found: list[Stage] = []
        told: set[str] = set()
        for name, stage in self.stages.items():
            circle = _closure(first, name)
            if name in circle and name not in told:
                found.append(stage)
                told |= {n for n in circle if name in _closure(first, n)}
        return found

    def never_end(self) -> list[Stage]:
        """Stages all of whose courses go on for ever, the first only."""
        lasting = [s for n, s in self.stages.items() if self._least_times[n] == NEVER]
        named = {n for s in lasting for n in self._mentions(s.name)}
        own = [s for s in lasting if s.name in named]
        return (own or lasting)[:1]

    def least_time(self, course: Course) -> float:
        """Seconds that a course takes at least, by its `for` clauses."""
        return self._least(course, self._least_times)

    def follows_on(self, course: Course) -> bool:
        """Whether a course has things in it that follow one another."""
        return self._follows_on(course, frozenset())

    def sole_action(self, course: Course) -> Action | None:
        """The action that a course asks for when it asks for no more than one, or None."""
        seen = set()
        while True:
            match course:
                case Timed(item=item):
                    course = item
                case Reference(stage=name):
                    action = self._as_action(course)
                    stage = self.stages.get(name)
                    if action is not None or stage is None or name in seen:
                        return action
                    if isinstance(stage.body, Actors):
                        return action
                    seen.add(name)
                    course = stage.body
                case _:
                    return self._as_action(course)

    def _as_action(self, course: Course) -> Action | None:
        """An action, or what a reference to an action in the strict form stands for."""
        if isinstance(course, Action):
            return course
        if isinstance(course, Reference):
            stage = self.stages.get(course.stage)
            if stage is not None and isinstance(stage.body, Actors):
                return Action(stage.name, stage.body.names, course.span)
        return None

    def _mentions(self, name: str) -> list[str]:
        body = self.stages[name].body
        if isinstance(body, Actors):
            return []
        return [c.stage for c in walk(body) if isinstance(c, Reference) and c.stage in self.stages]

    @cached_property
    def _empty_stages(self) -> frozenset[str]:
        empty: frozenset[str] = frozenset()
        while True:
            more = frozenset(
                n
                for n, s in self.stages.items()
                if not isinstance(s.body, Actors) and self._empty(s.body, empty)
            )
            if more == empty:
                return empty
            empty = more

    def _empty(self, course: Course, stages: frozenset[str]) -> bool:
        match course:
            case Reference(stage=name):
                return name in stages
            case Choice(options=options):
                return any(self._empty(o, stages) for o in options)
            case Sequence(items=parts) | Together(parts=parts):
                return all(self._empty(p, stages) for p in parts)
            case Timed(item=item):
                return self._empty(item, stages)
            case Repeated(item=item, mark=mark):
                return mark != "+" or self._empty(item, stages)
        return False

    def _first_of(self, name: str) -> frozenset[str]:
        body = self.stages[name].body
        return frozenset() if isinstance(body, Actors) else self._first(body)

    def _first(self, course: Course) -> frozenset[str]:
        """Stages that a course may come to before any action."""
        match course:
            case Reference(stage=name):
                return frozenset({name} & self.stages.keys())
            case Choice(options=parts) | Together(parts=parts):
                return frozenset().union(*(self._first(p) for p in parts))
            case Timed(item=item) | Repeated(item=item):
                return self._first(item)
            case Sequence(items=items):
                found: frozenset[str] = frozenset()
                for item in items:
                    found |= self._first(item)
                    if not self.may_be_left_out(item):
                        break
                return found
        return frozenset()

    @cached_property
    def _least_times(self) -> dict[str, float]:
        """Least seconds of each stage: the least fixed point from above, as in shortest paths."""
        times = dict.fromkeys(self.stages, NEVER)
        for _ in range(len(times) + 1):
            before = dict(times)
            for name, stage in self.stages.items():
                body = stage.body
                times[name] = 0.0 if isinstance(body, Actors) else self._least(body, times)
            if times == before:
                break
        return times

    def _least(self, course: Course, times: dict[str, float]) -> float:
        match course:
            case Reference(stage=name):
                return times.get(name, 0.0)
            case Choice(options=options):
                return min(self._least(o, times) for o in options)
            case Sequence(items=items):
                return sum(self._least(i, times) for i in items)
            case Together(parts=parts):
                return max(self._least(p, times) for p in parts)
            case Repeated(item=item, mark=mark):
                return self._least(item, times) if mark == "+" else 0.0
            case Timed(item=item, clauses=clauses):
                holds = [c.duration.seconds for c in clauses if isinstance(c, Hold)]
                return max(self._least(item, times), *holds, 0.0)
        return 0.0

    def _follows_on(self, course: Course, seen: frozenset[str]) -> bool:
        if any(isinstance(c, Sequence | Repeated) for c in walk(course)):
            return True
        for c in walk(course):
            if isinstance(c, Timed) and any(isinstance(x, Deadline) for x in c.clauses):
                continue
            if isinstance(c, Reference) and c.stage in self.stages and c.stage not in seen:
                body = self.stages[c.stage].body
                if not isinstance(body, Actors) and self._follows_on(body, seen | {c.stage}):
                    return True
        return False


def _closure(graph: dict[str, frozenset[str]], start: str) -> set[str]:
    """All that can be come to from a node, itself only along a circle."""
    seen: set[str] = set()
    todo = list(graph.get(start, ()))
    while todo:
        node = todo.pop()
        if node not in seen:
            seen.add(node)
            todo += graph.get(node, ())
    return seen

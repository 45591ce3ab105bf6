"""What the courses of a task must satisfy: they end, and their clauses and invariants agree."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property

from visup.tasks.actions import Meaning, contradict
from visup.tasks.faults import Source, TaskFault
from visup.tasks.language import Grammar
from visup.tasks.tree import (
    SECONDS_PER_UNIT,
    Action,
    Actors,
    Course,
    Deadline,
    Duration,
    Hold,
    Repeated,
    Span,
    Task,
    Timed,
    Together,
    walk,
)

UNITS = {
    "sec": "s", "secs": "s", "second": "s", "seconds": "s", "m": "min", "mins": "min",
    "minute": "min", "minutes": "min", "hr": "h", "hrs": "h", "hour": "h", "hours": "h",
    "msec": "ms", "msecs": "ms", "millisecond": "ms", "milliseconds": "ms",
}  # fmt: skip


@dataclass(frozen=True)
class CourseCheck:
    """Checks of the courses of a task.

    Attributes:
        task: The task, with at least one rule.
        source: For places.
        actions: The actions that it may ask for.
        whole: Whether every stage that it mentions is there.
    """

    task: Task
    source: Source
    actions: Mapping[str, Meaning]
    whole: bool

    @cached_property
    def grammar(self) -> Grammar:
        """The grammar of the task."""
        return Grammar(self.task)

    @cached_property
    def courses(self) -> list[Course]:
        """Every course of every stage, outermost first."""
        bodies = [s.body for s in self.task.stages if not isinstance(s.body, Actors)]
        return [c for body in bodies for c in walk(body)]

    def faults(self) -> Iterator[TaskFault]:
        """All faults of the courses."""
        yield from self.endless()
        yield from self.durations()
        yield from self.clauses()
        yield from self.together()
        yield from self.invariants()
        yield from self.repetitions()

    def fault(
        self,
        code: str,
        what: str,
        span: Span,
        expected: str | None = None,
        hint: str | None = None,
    ) -> TaskFault:
        """A fault at the place of a node."""
        return TaskFault(code, what, self.source.at(span), expected=expected, hint=hint)

    def endless(self) -> Iterator[TaskFault]:
        """Stages that never begin or never end."""
        begins = self.grammar.begin_with_themselves()
        for stage in begins:
            what = f"stage `<{stage.name}>` begins with itself and so never begins"
            hint = f"let something come first, such as `<try> | <try> <{stage.name}>`"
            yield self.fault("E206", what, stage.span, "an action before it comes again", hint)
        if begins or not self.whole:
            return
        for stage in self.grammar.never_end():
            what = f"stage `<{stage.name}>` can never end"
            hint = f"offer a way out, such as `( ... <{stage.name}> )?` or `| ...`"
            yield self.fault("E207", what, stage.span, "a course without the stage itself", hint)

    def durations(self) -> Iterator[TaskFault]:
        """Durations of nothing, or in unknown units."""
        for course in self.courses:
            if not isinstance(course, Timed):
                continue
            for duration in (c.duration for c in course.clauses):
                yield from self.duration(duration)

    def duration(self, duration: Duration) -> Iterator[TaskFault]:
        """What is wrong with one duration."""
        if duration.unit not in SECONDS_PER_UNIT:
            meant = UNITS.get(duration.unit.casefold())
            hint = f"did you mean `{meant}`?" if meant else None
            what = f"`{duration.unit}` is not a unit of time"
            yield self.fault("E218", what, duration.span, "`ms`, `s`, `min` or `h`", hint)
        elif duration.amount <= 0:
            yield self.fault("E217", f"`{duration}` is no time at all", duration.span)

    def clauses(self) -> Iterator[TaskFault]:
        """Clauses said twice, that contradict each other, or that hold nothing."""
        for course in self.courses:
            if not isinstance(course, Timed):
                continue
            holds = [c for c in course.clauses if isinstance(c, Hold)]
            deadlines = [c for c in course.clauses if isinstance(c, Deadline)]
            for word, clauses in (("for", holds), ("within", deadlines)):
                if len(clauses) > 1:
                    span = clauses[1].span
                    yield self.fault("E208", f"`{word}` is said twice", span, f"one `{word}`")
            least = self.grammar.least_time(course)
            for deadline in deadlines[:1]:
                if float("inf") > least > deadline.duration.seconds > 0:
                    what = f"what takes at least {least:g} s cannot be over {deadline}"
                    yield self.fault("E208", what, deadline.span, "a longer `within`")
            if holds and self.grammar.follows_on(course.item):
                what = f"`{holds[0]}` stands behind things that follow one another"
                hint = "put `for` behind the one that must hold"
                expected = "one action, or several at the same time"
                yield self.fault("E216", what, holds[0].span, expected, hint)

    def together(self) -> Iterator[TaskFault]:
        """Actions that can never hold at the same time."""
        for course in self.courses:
            if not isinstance(course, Together):
                continue
            parts = [self.grammar.sole_action(p) for p in course.parts]
            for i, a in enumerate(parts):
                for b in parts[i + 1 :]:
                    if a and b and self.contradict(a, b):
                        what = f"`{a}` and `{b}` can never hold at the same time"
                        yield self.fault("E209", what, course.span, hint="in turn is `a b`")

    def contradict(self, a: Action, b: Action) -> bool:
        """Whether two actions can never hold at the same time."""
        one, other = self.actions.get(a.name), self.actions.get(b.name)
        if one is None or other is None:
            return False
        return {str(x) for x in a.actors} == {str(x) for x in b.actors} and contradict(one, other)

    def invariants(self) -> Iterator[TaskFault]:
        """Invariants that the task itself breaks."""
        for invariant in self.task.invariants:
            for stage, action in self.grammar.asked:
                if invariant.during and invariant.during.stage != stage:
                    continue
                same = (action.name, {*action.actors}) == (
                    invariant.action.name,
                    {*invariant.action.actors},
                )
                breaks = same if invariant.when == "never" else False
                breaks = breaks or (
                    invariant.when == "always" and self.contradict(invariant.action, action)
                )
                if breaks:
                    what = f"`{invariant}`, but stage `<{stage}>` asks for `{action}`"
                    hint = "say for which stage it is meant with `during <stage>`"
                    yield self.fault("E210", what, invariant.span, hint=hint)
                    break

    def repetitions(self) -> Iterator[TaskFault]:
        """Repetitions of what may be left out."""
        for course in self.courses:
            if not isinstance(course, Repeated) or course.mark == "?":
                continue
            if self.grammar.may_be_left_out(course.item):
                what = f"`{course.mark}` repeats what may be left out, so it has no end"
                hint = "leave the `?` or `*` inside away"
                yield self.fault("E215", what, course.span, hint=hint)

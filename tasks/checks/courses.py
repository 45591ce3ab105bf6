"""Checks of courses: termination, and consistency of clauses and invariants."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from collections.abc import Set as AnySet
from dataclasses import dataclass
from functools import cached_property

from visup.agent.model.did_you_mean import closest
from visup.rules.language.diagnostics import Diagnostic, Source
from visup.tasks.actions.actions import ActionDefinition, contradict
from visup.tasks.grammar.analysis import Grammar
from visup.tasks.grammar.conditions import Fact
from visup.tasks.grammar.copies import MAX_ROUNDS, alike
from visup.tasks.grammar.graphs import reachable
from visup.tasks.grammar.nodes import (
    Action,
    Actors,
    Already,
    AnyOrder,
    Conditioned,
    Counted,
    Course,
    Deadline,
    Delay,
    Hold,
    Invariant,
    Reference,
    Repeated,
    Task,
    Timed,
    Together,
    walk,
)
from visup.tasks.grammar.templates import names_in
from visup.tasks.grammar.units import value

MAX_IN_ANY_ORDER = 12


@dataclass(frozen=True)
class CourseCheck:
    """Checks of the courses of a task.

    Attributes:
        task: The task, with at least one rule.
        source: For positions.
        actions: The known actions.
        all_defined: Whether all referenced stages are defined.
        grammar: The grammar of the task.
    """

    task: Task
    source: Source
    actions: Mapping[str, ActionDefinition]
    all_defined: bool
    grammar: Grammar

    @cached_property
    def courses(self) -> list[Course]:
        """Every course of every stage, outermost first."""
        bodies = [s.body for s in self.task.stages if not isinstance(s.body, Actors)]
        return [c for body in bodies for c in walk(body)]

    def faults(self) -> Iterator[Diagnostic]:
        """All faults of the courses."""
        yield from self.non_terminating()
        yield from self.conditions()
        yield from self.counts()
        yield from self.clauses()
        yield from self.already()
        yield from self.together()
        yield from self.invariants()
        yield from self.repetitions()

    def non_terminating(self) -> Iterator[Diagnostic]:
        """Stages that cannot begin or terminate."""
        left_recursive = self.grammar.left_recursive()
        for stage in left_recursive:
            what = f"stage `<{stage.name}>` begins with itself and so never begins"
            hint = f"let something come first, such as `<try> | <try> <{stage.name}>`"
            yield self.source.fault(
                "E206", what, stage.span, "an action before it comes again", hint
            )
        if left_recursive or not self.all_defined:
            return
        for stage in self.grammar.non_terminating():
            what = f"stage `<{stage.name}>` can never end"
            hint = f"add a way out, such as `( ... <{stage.name}> )?` or `| ...`"
            yield self.source.fault(
                "E207", what, stage.span, "an alternative without the stage itself", hint
            )

    def clauses(self) -> Iterator[Diagnostic]:
        """Clauses that are duplicate, contradictory or ineffective."""
        for course in self.courses:
            if not isinstance(course, Timed):
                continue
            holds = [c for c in course.clauses if isinstance(c, Hold)]
            deadlines = [c for c in course.clauses if isinstance(c, Deadline)]
            delays = [c for c in course.clauses if isinstance(c, Delay)]
            for word, clauses in (("for", holds), ("within", deadlines), ("after", delays)):
                if len(clauses) > 1:
                    span = clauses[1].span
                    yield self.source.fault(
                        "E208", f"`{word}` is given twice", span, f"one `{word}`"
                    )
            least = self.grammar.min_duration(course)
            for deadline in deadlines[:1]:
                if float("inf") > least > value(self.task.amount(deadline.duration)) > 0:
                    what = f"what takes at least {least:g} s cannot be over {deadline}"
                    longer = f"write `within {2 * least:g} s` in place of `{deadline}`"
                    yield self.source.fault(
                        "E208", what, deadline.span, "a longer `within`", longer
                    )
            for delay in delays[:1]:
                most = delay.most or delay.duration
                if value(self.task.amount(most)) < value(self.task.amount(delay.duration)):
                    what = f"`{delay}` is never: the greatest delay is less than the least"
                    swapped = f"write `after {most} to {delay.duration}` in place of `{delay}`"
                    expected = "a greater number after `to`"
                    yield self.source.fault("E208", what, delay.span, expected, swapped)
            if holds and self.grammar.is_sequential(course.item):
                what = f"`{holds[0]}` comes after a sequence"
                hint = "put `for` after the one that must hold"
                expected = "one action, or several at the same time"
                yield self.source.fault("E216", what, holds[0].span, expected, hint)

    def already(self) -> Iterator[Diagnostic]:
        """An `already` of an `already`, which says nothing more."""
        for course in self.courses:
            if isinstance(course, Already) and isinstance(course.item, Already):
                what, change = (
                    "`already` is given twice",
                    "write `already` in place of `already already`",
                )
                yield self.source.fault("E208", what, course.span, "one `already`", change)

    def together(self) -> Iterator[Diagnostic]:
        """Actions that can never hold at the same time."""
        for course in self.courses:
            if not isinstance(course, Together):
                continue
            parts = [self.grammar.sole_fact(p) for p in course.parts]
            for i, a in enumerate(parts):
                for b in parts[i + 1 :]:
                    if a and b and self.mutually_exclusive(a, b):
                        what = f"`{a}` and `{b}` can never hold at the same time"
                        yield self.source.fault("E209", what, course.span, hint="in turn is `a b`")

    def mutually_exclusive(self, a: Fact, b: Fact) -> bool:
        """Whether two facts can never hold at the same time."""
        if isinstance(a, Action) and isinstance(b, Action):
            return self.contradict(a, b)
        return False

    def contradict(self, a: Action, b: Action) -> bool:
        """Whether two actions can never hold at the same time."""
        one, other = self.actions.get(a.name), self.actions.get(b.name)
        if one is None or other is None:
            return False
        return set(a.arguments) == set(b.arguments) and contradict(one, other)

    def invariants(self) -> Iterator[Diagnostic]:
        """Invariants that the task itself breaks."""
        for invariant in self.task.invariants:
            affected = self.affected_stages(invariant.during)
            for stage, fact in self.grammar.asked:
                if stage in affected and self.violates(invariant, fact):
                    what = f"`{invariant}`, but stage `<{stage}>` asks for `{fact}`"
                    hint = "say for which stage it is meant with `during <stage>`"
                    yield self.source.fault("E210", what, invariant.span, hint=hint)
                    break

    def affected_stages(self, during: tuple[Reference, ...]) -> AnySet[str]:
        """The stages to which an invariant applies, with those inside them."""
        if not during:
            return self.grammar.stages.keys()
        known = [r.stage for r in during if r.stage in self.grammar.stages]
        return reachable(self.grammar.mentions, known)

    def violates(self, invariant: Invariant, fact: Fact) -> bool:
        """Whether a requirement of a stage breaks an invariant."""
        required = invariant.condition
        if not isinstance(required, Action) or not isinstance(fact, Action):
            return invariant.when == "never" and str(required) == str(fact)
        if invariant.when == "never":
            return (fact.name, {*fact.arguments}) == (required.name, {*required.arguments})
        return self.contradict(required, fact)

    def conditions(self) -> Iterator[Diagnostic]:
        """Stage conditions that are duplicate or ineffective."""
        for course in self.courses:
            if not isinstance(course, Conditioned):
                continue
            kinds: set[str] = set()
            for condition in course.conditions:
                if condition.kind in kinds:
                    what = f"`{condition.kind} when` is given twice"
                    hint = "join the conditions with `or` or `and`"
                    yield self.source.fault(
                        "E235", what, condition.span, f"one `{condition.kind} when`", hint
                    )
                kinds.add(condition.kind)
                if (
                    condition.kind == "pauses"
                    and self.grammar.sole_fact(course.item) == condition.condition
                ):
                    what = f"what is asked for, `{condition.condition}`, also pauses it, so it is never done"
                    yield self.source.fault("E208", what, condition.span, "another condition")
                if condition.kind in ("begins", "ends") and self.grammar.is_sequential(course.item):
                    what = f"`{condition.kind} when` comes after a sequence"
                    hint = f"put it after the one that {condition.kind} so"
                    expected = "one action, or several at the same time"
                    yield self.source.fault("E232", what, condition.span, expected, hint)

    def counts(self) -> Iterator[Diagnostic]:
        """Contradictory counts, and `any order` with too many items."""
        for course in self.courses:
            if isinstance(course, Counted) and course.most is not None:
                if course.most == 0:
                    yield self.source.fault(
                        "E233", "`at most 0 times` requires nothing", course.span
                    )
                elif course.most < course.least:
                    what = f"at least {course.least} and at most {course.most} times is never"
                    yield self.source.fault("E233", what, course.span, "a greater `at most`")
            if isinstance(course, AnyOrder) and course.new:
                yield from self.rounds(course)
            if isinstance(course, AnyOrder) and (course.count or 0) > len(course.items):
                what = f"{course.count} of {len(course.items)} things are never done"
                corrected = f"any {len(course.items)} of"
                hint = f"write `{corrected}` in place of `any {course.count} of`"
                yield self.source.fault(
                    "E233", what, course.span, f"`{corrected}`, or more things", hint
                )
            if isinstance(course, AnyOrder) and len(course.items) > MAX_IN_ANY_ORDER:
                what = f"{len(course.items)} things in any order have too many orders to follow"
                hint = "group those that follow one another"
                expected = f"at most {MAX_IN_ANY_ORDER}"
                yield self.source.fault("E234", what, course.span, expected, hint)

    def rounds(self, loop: AnyOrder) -> Iterator[Diagnostic]:
        """A loop with a new actor in each round that has no rounds, or does not use the actor."""
        least, most = loop.least or 0, loop.count
        if most is not None and most < max(1, least):
            what = f"at least {least} and at most {most} rounds are never"
            yield self.source.fault("E233", what, loop.span, "a greater `at most`")
        elif max(least, most or 0) > MAX_ROUNDS:
            what = f"a loop with a new `{loop.new}` each time has at most {MAX_ROUNDS} rounds"
            yield self.source.fault("E234", what, loop.span, f"at most {MAX_ROUNDS} times")
        if alike(loop):
            what = f"`for each new {loop.new}`, but what is to be done names no `{loop.new}`"
            near = closest(loop.new, names_in(loop.items[0]))
            hint = f"name it, such as `<take({loop.new})>`"
            hint = f"write `{loop.new}` in place of `{near}`" if near else hint
            yield self.source.fault("E225", what, loop.span, f"`{loop.new}` among the actors", hint)

    def repetitions(self) -> Iterator[Diagnostic]:
        """Repetitions of optional courses."""
        for course in self.courses:
            mark = "at least" if isinstance(course, Counted) else getattr(course, "mark", "?")
            if not isinstance(course, Repeated | Counted) or mark == "?":
                continue
            if self.grammar.nullable(course.item):
                what = f"`{mark}` repeats what may be left out, so it has no end"
                hint = "remove the `?` or `*` inside"
                yield self.source.fault("E215", what, course.span, hint=hint)

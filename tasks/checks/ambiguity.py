"""Stages that no observation can distinguish."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

from visup.rules.formula.units import Span
from visup.rules.language.diagnostics import Diagnostic, Source
from visup.tasks.grammar.analysis import Grammar
from visup.tasks.grammar.conditions import Fact
from visup.tasks.grammar.graphs import dependencies_first
from visup.tasks.grammar.nodes import (
    Action,
    Actors,
    Already,
    AnyOrder,
    Choice,
    Conditioned,
    Counted,
    Course,
    Hold,
    Reference,
    Repeated,
    Sequence,
    Task,
    Timed,
    Together,
    children,
    walk,
)

DEEPEST = 40  # depth of nested references
NOTHING = Action("", ())


@dataclass(frozen=True)
class AmbiguityCheck:
    """Checks whether the stages of a task can be distinguished.

    Attributes:
        task: The complete task.
        source: For positions.
        grammar: Its grammar.
    """

    task: Task
    source: Source
    grammar: Grammar

    def faults(self) -> Iterator[Diagnostic]:
        """One fault for each pair of adjacent courses that look the same."""
        for stage in self.grammar.stages.values():
            if isinstance(stage.body, Actors):
                continue
            for course in walk(stage.body):
                if isinstance(course, Choice):
                    yield from self.ambiguous_choices(course)
                elif isinstance(course, Sequence):
                    yield from self.ambiguous_sequences(course)

    def ambiguous_choices(self, choice: Choice) -> Iterator[Diagnostic]:
        """Alternatives with the same requirements."""
        first_with_form: dict[int, Course] = {}
        for option in choice.options:
            form = self.normal_forms.of(option)
            if form is not None and form in first_with_form:
                what = f"no observation can tell `{option}` from `{first_with_form[form]}`"
                hint = "take one of them out, or say by what they differ"
                yield self.fault(what, option.span, hint)
            elif form is not None:
                first_with_form[form] = option

    def ambiguous_sequences(self, sequence: Sequence) -> Iterator[Diagnostic]:
        """Adjacent courses with the same requirements and no `for` or condition to separate them."""
        for before, after in zip(sequence.items, sequence.items[1:], strict=False):
            one, other = self.plain_fact(before), self.plain_fact(after)
            if one is not None and one == other:
                what = f"no observation can tell where `{before}` ends and `{after}` begins"
                hint = f"say it once, or how long the first lasts: `{before} for 5 s {after}`"
                yield self.fault(what, after.span, hint)

    def fault(self, what: str, span: Span, hint: str) -> Diagnostic:
        """A fault at the position of a course."""
        return self.source.fault("E230", what, span, hint=hint)

    def plain_fact(self, course: Course) -> Fact | None:
        """The only action of a course without `for` and conditions, or None."""
        fact = self.grammar.sole_fact(course)
        return None if fact is None or self.has_clauses(course) else fact

    def has_clauses(self, course: Course) -> bool:
        """Whether a course has a `for` or condition around its only action."""
        for _ in range(DEEPEST):
            match course:
                case Conditioned():
                    return True
                case Timed(item=item, clauses=clauses):
                    if any(isinstance(c, Hold) for c in clauses):
                        return True
                    course = item
                case Reference(stage=name) if name in self.grammar.stages:
                    body = self.grammar.stages[name].body
                    if isinstance(body, Actors):
                        return False
                    course = body
                case _:
                    return False
        return True

    @cached_property
    def normal_forms(self) -> _NormalForms:
        """The normal forms of all stages."""
        return _NormalForms(self.grammar)


class _NormalForms:
    """Numbers courses by their normal forms with stages expanded: equal numbers look the same.

    Equal parts share a number, so that a stage that is referred to often is processed once.
    """

    def __init__(self, grammar: Grammar) -> None:
        self._numbers: dict[object, int] = {}
        self._stages: dict[str, int | None] = {}
        for name in dependencies_first(grammar.mentions):
            body = grammar.stages[name].body
            course = Action(name, body.names) if isinstance(body, Actors) else body
            self._stages[name] = self.of(course)

    def of(self, course: Course) -> int | None:
        """The number of a course; None if it is recursive."""
        if isinstance(course, Reference):
            return self._stages.get(course.stage)
        if not children(course):
            return self._number(course)
        inner = [self.of(c) for c in children(course)]
        if any(i is None for i in inner):
            return None
        if isinstance(course, Choice | Together | AnyOrder):
            count = (course.count, course.least) if isinstance(course, AnyOrder) else None
            return self._number((type(course).__name__, count, frozenset(inner)))
        if isinstance(course, Sequence):
            return self._number(tuple(inner))
        if isinstance(course, Conditioned | Timed | Counted | Repeated | Already):
            return self._number((replace(course, item=NOTHING), inner[0]))
        return None

    def _number(self, form: object) -> int:
        return self._numbers.setdefault(form, len(self._numbers))

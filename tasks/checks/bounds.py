"""Limits of task files, so that any accepted task can be supervised in bounded time and memory."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import chain, islice
from math import prod

from visup.rules.language.diagnostics import Diagnostic, Source
from visup.rules.language.parser import LONG_NUMBER
from visup.tasks.grammar.analysis import Grammar
from visup.tasks.grammar.graphs import dependencies_first
from visup.tasks.grammar.nodes import (
    Actors,
    AnyOrder,
    Choice,
    Conditioned,
    Counted,
    Course,
    Reference,
    Repeated,
    Sequence,
    Timed,
    Together,
    walk,
)

LONGEST_FILE = 600_000
"""Maximum characters of a task with its includes; the longest shipped one has two thousand."""
LONGEST_LINE = 20_000
MAX_FAULTS = 100
"""Maximum number of reported mistakes of a file."""
MAX_STAGES = 2_000
"""Maximum number of stages of a file. A run with 2,000 starts within seconds; with 10,000 it takes a
minute."""
DEEPEST_STAGES = 100
"""Maximum nesting of stages, limited by Python's recursion depth."""
MAX_START_STATES = 500
"""Maximum number of initial states of a course. With 256 a step takes 10 ms, with 4,000 half a second;
parallel alternatives multiply."""
MAX_TOGETHER = 12
"""Maximum number of parallel courses, each of which may advance by itself."""


def text_fault(text: str, source: Source) -> Diagnostic | None:
    """A fault of the size of a text, before parsing."""
    if len(text) > LONGEST_FILE:
        what = f"the file has {len(text)} characters"
        return Diagnostic("E137", what, source.place(1, 1), f"at most {LONGEST_FILE}")
    for number, line in enumerate(text.split("\n"), start=1):
        if LONG_NUMBER.search(line):
            what = "a number has more digits than a number can"
            return Diagnostic("E137", what, source.place(number, 1), "at most 40 digits")
        if len(line) > LONGEST_LINE:
            what = f"the line has {len(line)} characters"
            hint = "a statement may go on in the next line"
            return Diagnostic(
                "E137", what, source.place(number, 1), f"at most {LONGEST_LINE}", hint
            )
    return None


@dataclass(frozen=True)
class BoundsCheck:
    """Checks of the size of a task.

    Attributes:
        grammar: Grammar of the task, with at least one rule.
        source: For positions.
    """

    grammar: Grammar
    source: Source

    def faults(self) -> Iterator[Diagnostic]:
        """The first exceeded limit."""
        yield from islice(chain(self._sizes(), self._stages()), 1)

    def _sizes(self) -> Iterator[Diagnostic]:
        stages = self.grammar.task.stages
        if len(stages) > MAX_STAGES:
            what = f"the task has {len(stages)} stages"
            place = stages[MAX_STAGES].span
            yield self.source.fault("E239", what, place, f"at most {MAX_STAGES}")
        bodies = [s.body for s in stages if not isinstance(s.body, Actors)]
        for course in (c for body in bodies for c in walk(body)):
            if isinstance(course, Together) and len(course.parts) > MAX_TOGETHER:
                what = f"{len(course.parts)} things at the same time"
                yield self.source.fault("E239", what, course.span, f"at most {MAX_TOGETHER}")

    def _stages(self) -> Iterator[Diagnostic]:
        for name in self._order:
            place = self.grammar.stages[name].span
            if self._depths[name] > DEEPEST_STAGES:
                what = f"stage `<{name}>` has more than {DEEPEST_STAGES} stages inside one another"
                hint = "write those that follow one another side by side"
                yield self.source.fault("E239", what, place, hint=hint)
            if self._start_counts[name] > MAX_START_STATES:
                what = f"stage `<{name}>` may begin in {self._start_count_text(name)} ways"
                hint = "use fewer alternatives at the same time"
                yield self.source.fault("E239", what, place, f"at most {MAX_START_STATES}", hint)

    @cached_property
    def _order(self) -> list[str]:
        """Stages, each after those that it refers to, apart from cycles."""
        return dependencies_first(self.grammar.mentions)

    @cached_property
    def _depths(self) -> dict[str, int]:
        depths: dict[str, int] = {}
        for name in self._order:
            inside = (depths.get(n, 0) for n in self.grammar.mentions[name])
            depths[name] = 1 + max(inside, default=0)
        return depths

    @cached_property
    def _start_counts(self) -> dict[str, int]:
        start_counts: dict[str, int] = {}
        for name in self._order:
            body = self.grammar.stages[name].body
            start_counts[name] = 1
            if not isinstance(body, Actors):
                # Also later states: an inner course may branch more than the beginning.
                inside = (c for c in walk(body) if isinstance(c, Together))
                most = max((self._start_count(c, start_counts) for c in inside), default=1)
                start_counts[name] = min(
                    max(most, self._start_count(body, start_counts)), MAX_START_STATES**2
                )
        return start_counts

    def _start_count(self, course: Course, start_counts: dict[str, int]) -> int:
        """Upper bound of the number of initial states of a course, counting being skipped as one."""
        match course:
            case Reference(stage=name):
                return start_counts.get(name, 1)
            case Choice(options=parts) | AnyOrder(items=parts):
                return sum(self._start_count(p, start_counts) for p in parts)
            case Together(parts=parts):
                return prod(
                    min(self._start_count(p, start_counts), MAX_START_STATES) for p in parts
                )
            case Repeated(item=item) | Counted(item=item):
                return self._start_count(item, start_counts) + 1
            case Timed(item=item) | Conditioned(item=item):
                return self._start_count(item, start_counts)
            case Sequence(items=items):
                return self._sequence_start_count(items, start_counts)
        return 1

    def _sequence_start_count(self, items: tuple[Course, ...], start_counts: dict[str, int]) -> int:
        total = 0
        for item in items:
            total += self._start_count(item, start_counts)
            if not self.grammar.nullable(item):
                break
        return total

    def _start_count_text(self, name: str) -> str:
        return (
            str(self._start_counts[name])
            if self._start_counts[name] < MAX_START_STATES**2
            else "countless"
        )

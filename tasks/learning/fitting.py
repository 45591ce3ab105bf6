"""Fits the durations of an existing task to runs: each `within` and `for` of a stage, edited in its text."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import floor

from visup.rules.formula.units import Number, Span
from visup.tasks.analysis.judging import JudgedRun
from visup.tasks.grammar.nodes import (
    Actors,
    Conditioned,
    Course,
    Deadline,
    Delay,
    Task,
    Timed,
    walk,
)
from visup.tasks.grammar.units import value
from visup.tasks.learning.drafts import deadline

SHORTEST_SHARE = 0.8
"""A fitted `for` is this share of the shortest duration in a good run."""


@dataclass(frozen=True, slots=True)
class FittedAmount:
    """One fitted amount.

    Attributes:
        stage: The stage of the clause.
        clause: The original text, such as `within 60 s`.
        new: The clause with the new amount.
        seen: The observed durations, as text.
        span: Source span of the amount.
    """

    stage: str
    clause: str
    new: str
    seen: str
    span: Span


def fitted_amounts(task: Task, runs: Sequence[JudgedRun]) -> list[FittedAmount]:
    """New amounts for the clauses of all stages that some run completed.

    Args:
        task: The task.
        runs: Its judged good runs.
    """
    return [f for clause in _clauses(task) if (f := _fitted(clause, runs)) is not None]


def with_amounts(text: str, fitted: Sequence[FittedAmount]) -> str:
    """The text of a task file with the amounts replaced and nothing else changed."""
    lines = text.split("\n")
    for change in sorted(fitted, key=lambda f: (f.span.line, f.span.column), reverse=True):
        line = lines[change.span.line - 1]
        amount = change.new.split(" ", 1)[1]
        begin, end = change.span.column - 1, change.span.end_column - 1
        lines[change.span.line - 1] = line[:begin] + amount + line[end:]
    return "\n".join(lines)


Clause = tuple[str, str, Number, bool]
"""Stage, keyword and amount of a clause, and whether it encloses a pause, whose time then counts."""


def _clauses(task: Task) -> Iterator[Clause]:
    """Each clause with a literal number of this file."""
    for stage in task.stages:
        if isinstance(stage.body, Actors):
            continue
        for course in walk(stage.body):
            if not isinstance(course, Timed):
                continue
            for clause in course.clauses:
                if isinstance(clause, Delay):
                    continue
                if isinstance(clause.duration, Number) and not clause.duration.span.file:
                    word = "within" if isinstance(clause, Deadline) else "for"
                    yield stage.name, word, clause.duration, _pauses(course)


def _pauses(course: Course) -> bool:
    """Whether a course contains a pause condition."""
    return any(
        c.kind == "pauses" for x in walk(course) if isinstance(x, Conditioned) for c in x.conditions
    )


def _durations(stage: str, run: JudgedRun, *, pauses: bool) -> Iterator[float]:
    """Duration of a stage in a run that completed it, seconds, with or without its pauses."""
    if stage in run.spans():
        begin, end = run.spans()[stage]
        yield end - begin - (0.0 if pauses else run.paused_s().get(stage, 0.0))


def _fitted(clause: Clause, runs: Sequence[JudgedRun]) -> FittedAmount | None:
    stage, word, amount, pauses = clause
    durations = [seconds for r in runs for seconds in _durations(stage, r, pauses=pauses)]
    if not durations:
        return None
    new = (
        deadline(durations)
        if word == "within"
        else max(0.5, floor(20 * SHORTEST_SHARE * min(durations)) / 20)
    )
    if abs(value(amount) - new) < 1e-9:
        return None
    seen = f"{len(durations)} of {len(runs)} runs, {min(durations):.1f} to {max(durations):.1f} s"
    return FittedAmount(stage, f"{word} {amount}", f"{word} {new:g} s", seen, amount.span)

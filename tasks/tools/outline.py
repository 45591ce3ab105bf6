"""The outline of a task as a tree of branches, for the terminal and the report."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

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
    Reference,
    Repeated,
    Sequence,
    Task,
    Timed,
    Together,
)

Kind = Literal["task", "stage", "action", "actor", "clause", "way", "words"]
"""Kind of a branch: `clause` is a condition on its content, `way` the order of its parts."""

REPEATS = {"?": "perhaps", "*": "any number of times", "+": "at least once"}
TITLES = {Choice: "one of", Together: "at the same time", AnyOrder: "each, in any order"}


@dataclass(frozen=True, slots=True)
class Branch:
    """A node of the tree of a task.

    Attributes:
        text: Its text.
        kind: Its kind.
        stage: Its stage; empty for the task itself.
        inside: Its branches.
        again: Whether it only refers to a stage shown above.
    """

    text: str
    kind: Kind
    stage: str = ""
    inside: tuple[Branch, ...] = ()
    again: bool = False


def outline(task: Task) -> Branch:
    """The outline of a task: its stages with their requirements.

    Args:
        task: A valid task.

    Returns:
        The root branch; each stage is expanded at its first reference.
    """
    return Branch(task.name, "task", "", tuple(_stage(task, task.name, set())))


def _stage(task: Task, name: str, drawn: set[str]) -> Iterator[Branch]:
    """The requirements of a stage; empty if it is shown already."""
    stage = task.stage(name)
    if stage is None or name in drawn:
        return
    drawn.add(name)
    if stage.text:
        yield Branch(stage.text, "words", name)
    if isinstance(stage.body, Actors):
        for actor in stage.body.names:
            yield Branch(str(actor), "actor", name)
    else:
        yield from _course(task, stage.body, name, drawn)


def _course(task: Task, course: Course, stage: str, drawn: set[str]) -> Iterator[Branch]:
    """The branches of a course in the order of the text."""

    def under(text: str, kind: Kind, *items: Course) -> Branch:
        inside = tuple(b for i in items for b in _course(task, i, stage, drawn))
        return Branch(text, kind, stage, inside)

    match course:
        case Action() | Comparison():
            yield Branch(str(course), "action", stage)
        case Reference(stage=name):
            again = name in drawn
            yield Branch(name, "stage", name, tuple(_stage(task, name, drawn)), again)
        case Sequence(items=items):
            for item in items:
                yield from _course(task, item, stage, drawn)
        case AnyOrder(items=(first, *_), new=str(new)) if new:
            yield under(f"each new {new}", "way", first)
        case Choice(options=parts) | Together(parts=parts) | AnyOrder(items=parts):
            inside: list[Branch] = []
            for part in parts:
                in_turn = isinstance(part, Sequence)
                inside += (
                    [under("in turn", "way", part)]
                    if in_turn
                    else _course(task, part, stage, drawn)
                )
            yield Branch(TITLES[type(course)], "way", stage, tuple(inside))
        case Timed(item=item, clauses=said) | Conditioned(item=item, conditions=said):
            yield under(" ".join(map(str, said)), "clause", item)
        case Already(item=item):
            yield under("already", "clause", item)
        case Repeated(item=item, mark=mark):
            yield under(REPEATS[mark], "way", item)
        case Counted(item=item):
            yield under(course.times, "way", item)

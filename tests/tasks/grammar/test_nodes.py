from __future__ import annotations

import pytest
from hypothesis import given, settings

from tests.tasks.trees import tasks
from visup.tasks.grammar.conditions import actors_of
from visup.tasks.grammar.nodes import Action, Name, Sequence, Task, children, walk
from visup.tasks.grammar.parser import read

LAW = settings(max_examples=50, deadline=None)


@LAW
@given(tasks)
def test_a_printed_tree_reads_back_as_itself(task: Task) -> None:
    assert read(str(task)) == task


@LAW
@given(tasks)
def test_printing_is_stable(task: Task) -> None:
    once = str(task)
    assert str(read(once)) == once


@pytest.mark.parametrize(
    "course",
    [
        "a(x) b(x) | c(x)",
        "a(x) (b(x) | c(x))",
        "a(x) & b(x) c(x)",
        "a(x) & (b(x) c(x))",
        "(a(x) | b(x)) & c(x)",
        "a(x) for 5 s & b(x) within 2 min",
        "(a(x) & b(x)) for 5 s",
        "a(x)* for 5 s",
        "(a(x) for 5 s)*",
        "(a(x)?)+",
        "<a> <b>+ (<c> | <d>)?",
        "((a(x) b(x)) c(x)) d(x)",
        "a(x) (b(x) (c(x) d(x)))",
        "a(x) for 5 s at least 2 times within 60 s",
        "(a(x) for 5 s) within 60 s",
        "(a(x) at least 2 times) at most 3 times",
        "a(x) at least 2 times at most 3 times",
        "a(x) fails when b(x) or c(x) and not d(x) for 2 s & e(x)",
        "(a(x) fails when b(x)) for 5 s",
        "a(x) ends when (b(x) or c(x)) and d(x)",
        "any order (a(x) b(x), <c> | d(x), gap(x, y) < 20 px)",
        "gap(x, y) < reach <b>",
        "a(x) ends when not not b(x)",
    ],
)
def test_brackets_are_kept_where_they_mean_something_and_nowhere_else(course: str) -> None:
    text = f"<t> ::= {course}"
    if course.startswith("(("):
        text = "<t> ::= ((a(x) b(x)) c(x)) d(x)"
    assert str(read(text)) == text


def test_needless_brackets_go() -> None:
    assert str(read("<t> ::= ((a(x)) (b(x)))")) == "<t> ::= a(x) b(x)"


def test_places_take_no_part_in_equality_but_are_right() -> None:
    one, other = read("<t> ::= a(x, y)"), read("# first\n  <t>\n ::=   a( x,\n y)")
    assert one == other
    assert hash(one) == hash(other)
    first, second = one.stages[0].body, other.stages[0].body
    assert isinstance(first, Action)
    assert isinstance(second, Action)
    assert (first.span.line, first.span.column) == (1, 9)
    assert (second.span.line, second.span.column, second.span.end_line) == (3, 8, 4)
    place = actors_of(second)[1].span
    assert (place.line, place.column) == (4, 2)


def test_walking_meets_every_course_outermost_first() -> None:
    a, b, c = (Action(n, (Name("x"),)) for n in "abc")
    inner = Sequence((b, c))
    whole = Sequence((a, inner))
    assert list(walk(whole)) == [whole, a, inner, b, c]
    assert children(a) == ()

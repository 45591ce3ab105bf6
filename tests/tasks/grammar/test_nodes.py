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
def test_a_printed_tree_is_parsed_back(task: Task) -> None:
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
def test_necessary_brackets_are_kept(course: str) -> None:
    text = f"<t> ::= {course}"
    if course.startswith("(("):
        text = "<t> ::= ((a(x) b(x)) c(x)) d(x)"
    assert str(read(text)) == text


def test_redundant_brackets_are_removed() -> None:
    assert str(read("<t> ::= ((a(x)) (b(x)))")) == "<t> ::= a(x) b(x)"


def test_positions_are_correct_and_ignored_by_equality() -> None:
    plain, spaced = read("<t> ::= a(x, y)"), read("# first\n  <t>\n ::=   a( x,\n y)")
    assert plain == spaced
    assert hash(plain) == hash(spaced)
    first, second = plain.stages[0].body, spaced.stages[0].body
    assert isinstance(first, Action)
    assert isinstance(second, Action)
    assert (first.span.line, first.span.column) == (1, 9)
    assert (second.span.line, second.span.column, second.span.end_line) == (3, 8, 4)
    span = actors_of(second)[1].span
    assert (span.line, span.column) == (4, 2)


def test_walk_is_a_preorder_traversal() -> None:
    a, b, c = (Action(n, (Name("x"),)) for n in "abc")
    inner = Sequence((b, c))
    whole = Sequence((a, inner))
    assert list(walk(whole)) == [whole, a, inner, b, c]
    assert children(a) == ()

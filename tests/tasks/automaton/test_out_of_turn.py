"""Steps out of turn: every course to them leads through a step that is missing."""

from __future__ import annotations

from collections.abc import Iterable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from visup.tasks import parse_task
from visup.tasks.automaton.automaton import Automaton
from visup.tasks.automaton.out_of_turn import later_steps, out_of_turn


def automaton_of(course: str, stages: Iterable[str]) -> Automaton:
    lines = [f"<{s}> ::= touching(part_{s}, base)" for s in stages]
    return Automaton(parse_task("\n".join([f"<t> ::= {course}", *lines])))


def early_step(course: str, stages: str, held: str, lacking: str) -> tuple[str, str] | None:
    """The stages of what is out of turn at the start, and of what must come first."""
    automaton = automaton_of(course, stages)
    nodes = [n for n, _ in automaton.start]
    steps = [s for s in later_steps(automaton, nodes) if s.stage in held]
    result = out_of_turn(automaton, nodes, steps, lambda s: s.stage in lacking)
    return None if result is None else (result[0].stage, result[1].stage)


ROW = "abcde"


@given(st.sets(st.sampled_from(ROW)), st.sets(st.sampled_from(ROW)))
def test_the_first_held_action_behind_a_missing_one_is_found(
    held: set[str], lacking: set[str]
) -> None:
    behind = [s for s in ROW if s in held and any(x in lacking for x in ROW[: ROW.index(s)])]
    expected = (behind[0], min(lacking)) if behind else None
    course = " ".join(f"<{s}>" for s in ROW)
    assert early_step(course, ROW, "".join(held), "".join(lacking)) == expected


@pytest.mark.parametrize(
    ("course", "held", "lacking", "expected"),
    [
        ("(<a> | <b>) <c>", "c", "a", None),  # the other way is open
        ("<a> <c> | <b> <c>", "c", "a", None),
        ("<a> <c> | <a> <b> <c>", "c", "a", ("c", "a")),  # both lead through it
        ("<a> <b>? <c>", "c", "b", None),  # it may be left out
        ("<a> <b>? <c>", "c", "ab", ("c", "a")),
        ("any order (<a>, <b>) <c>", "b", "a", None),  # it may come first
        ("any order (<a>, <b>) <c>", "c", "b", ("c", "b")),
        ("<a> <b>+ <c>", "c", "b", ("c", "b")),
        ("<a> <b>* <c>", "c", "b", None),
        ("(<a> & <b>) <c>", "c", "b", ("c", "b")),  # one of two that go on side by side
        ("<a> <b> <c>", "c", "", None),
        ("<a> <b> <c>", "", "ab", None),
    ],
)
def test_early_steps_are_found_in_each_kind_of_course(
    course: str, held: str, lacking: str, expected: tuple[str, str] | None
) -> None:
    assert early_step(course, "abc", held, lacking) == expected


def test_an_endless_task_is_searched_up_to_a_limit() -> None:
    automaton = automaton_of("<a> (<t> <b>)?", "ab")
    assert 2 <= len(later_steps(automaton, [automaton.start[0][0]])) < 10

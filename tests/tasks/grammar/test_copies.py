"""`for each of 4 legs`: several things of one kind, without their declarations."""

from __future__ import annotations

import pytest

from visup.tasks import parse_task
from visup.tasks.grammar.parser import read

MOUNT = "<mount(leg)> ::= converging(leg, top) touching(leg, top)\n"
LONG = """actor leg_1 is leg
actor leg_2 is another leg
actor leg_3 is another leg
<table> ::= for each leg of (leg_1, leg_2, leg_3) <mount(leg)>
"""


def test_several_things_are_said_shorter() -> None:
    assert read("<table> ::= for each of 3 legs <mount(leg)>\n" + MOUNT) == read(LONG + MOUNT)


@pytest.mark.parametrize(
    ("plural", "one"), [("legs", "leg"), ("boxes", "box"), ("bodies", "body"), ("sheep", "sheep")]
)
def test_one_of_them_is_what_the_course_calls_it(plural: str, one: str) -> None:
    task = read(f"<t> ::= for each of 2 {plural} touching({one}, bin)")
    assert [a.name for a in task.actors] == [f"{one}_1", f"{one}_2"]


def test_what_is_said_of_the_kind_is_said_of_each() -> None:
    task = parse_task("actor leg is red\n<t> ::= for each of 2 legs touching(leg, top)")
    assert list(map(str, task.actors)) == ["actor leg_1 is red", "actor leg_2 is another red"]
    again = "actor leg_2 is green\n<t> ::= for each of 2 legs touching(leg, top)"
    assert {str(a) for a in read(again).actors} == {"actor leg_2 is green", "actor leg_1 is leg"}

"""`for each of 4 legs`: several things of one kind, without their declarations."""

from __future__ import annotations

import re
from itertools import islice

import pytest

from visup.tasks import parse_task
from visup.tasks.grammar.nodes import Actors, AnyOrder, Course, Task, walk
from visup.tasks.grammar.parser import read
from visup.tasks.tools.simulate import traces

MOUNT = "<mount(leg)> ::= converging(leg, top) touching(leg, top)\n"
LONG = """actor leg_1 is leg
actor leg_2 is another leg
actor leg_3 is another leg
<table> ::= for each leg of (leg_1, leg_2, leg_3) <mount(leg)>
"""


def test_several_objects_of_a_kind_can_be_declared_together() -> None:
    assert read("<table> ::= for each of 3 legs <mount(leg)>\n" + MOUNT) == read(LONG + MOUNT)


@pytest.mark.parametrize(
    ("plural", "singular"),
    [("legs", "leg"), ("boxes", "box"), ("bodies", "body"), ("sheep", "sheep")],
)
def test_the_singular_names_the_actors(plural: str, singular: str) -> None:
    task = read(f"<t> ::= for each of 2 {plural} touching({singular}, bin)")
    assert [a.name for a in task.actors] == [f"{singular}_1", f"{singular}_2"]


def test_a_declaration_of_the_kind_applies_to_each_actor() -> None:
    task = parse_task("actor leg is red\n<t> ::= for each of 2 legs touching(leg, top)")
    assert list(map(str, task.actors)) == ["actor leg_1 is red", "actor leg_2 is another red"]
    again = "actor leg_2 is green\n<t> ::= for each of 2 legs touching(leg, top)"
    assert {str(a) for a in read(again).actors} == {"actor leg_2 is green", "actor leg_1 is leg"}


TAKE = "<take(part)> ::= coupled(arm, part) decoupled(arm, part)\n"


@pytest.mark.parametrize(
    ("loop", "min_rounds", "max_rounds"),
    [
        ("for each new part <take(part)>", 1, None),
        ("(for each new part <take(part)>)*", 0, None),
        ("for each new part <take(part)> at least 2 times", 2, None),
        ("for each new part <take(part)> at least 2 times at most 5 times", 2, 5),
        ("for each new part <take(part)> at most 5 times", 1, 5),
    ],
)
def test_a_loop_over_new_objects_has_bounds_on_its_rounds(
    loop: str, min_rounds: int, max_rounds: int | None
) -> None:
    task = parse_task(f"<empty> ::= {loop} gone(arm)\n{TAKE}never touching(part, floor)")
    (course,) = (c for c in walk(body_of(task)) if isinstance(c, AnyOrder))
    assert (course.least, course.count, course.new) == (min_rounds, max_rounds, "part")
    assert parse_task(str(task)) == task
    assert {a.spare for a in task.actors} == {"part"}
    assert {str(i) for i in task.invariants} == {
        f"never touching(part_{k}, floor)" for k in range(1, 13)
    }


def test_a_loop_is_equivalent_to_any_number_of_its_rounds() -> None:
    loop = read(f"<t> ::= for each new part <take(part)> at most 2 times gone(arm)\n{TAKE}")
    some = ", ".join(f"<take(part_{k})>" for k in range(1, 13))
    twin = read(f"<t> ::= (any 1 of ({some}) | any 2 of ({some})) gone(arm)\n{TAKE}")
    assert ordered(loop) == ordered(twin)


def body_of(task: Task) -> Course:
    body = task.stages[0].body
    assert not isinstance(body, Actors)
    return body


def ordered(task: Task) -> set[str]:
    """The first courses of a task, its parts numbered as they come."""
    courses = set()
    for trace in islice(traces(task), 40):
        text = " | ".join(step for moment in trace for step in moment)
        for k, name in enumerate(dict.fromkeys(re.findall(r"part_\d+", text)), 1):
            text = re.sub(rf"\b{name}\b", f"part {k}", text)
        courses.add(text)
    return courses

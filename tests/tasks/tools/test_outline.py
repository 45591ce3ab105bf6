"""The tree of a task as branches: every stage once, in the order of the text."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from visup.tasks.checks.load import parse_task
from visup.tasks.grammar.structure import stage_names
from visup.tasks.tools.outline import Branch, outline

RETRY = """<dock> ::= <approach> (<captured> | <back_off> <dock>)
<approach> ::= converging(arm, satellite)
<captured> ::= coupled(arm, satellite) for 2 s
<back_off> ::= diverging(arm, satellite)+
"""
STRICT = """<dock> ::= <approach> <captured>
<approach> ::= <converging>
<captured> ::= <coupled>
<converging> ::= arm satellite
<coupled> ::= arm satellite
"""


def walk(branch: Branch) -> Iterator[Branch]:
    yield branch
    for inner in branch.inside:
        yield from walk(inner)


@pytest.mark.parametrize("text", [RETRY, STRICT])
def test_every_stage_is_expanded_once(text: str) -> None:
    task = parse_task(text)
    stages = [b for b in walk(outline(task)) if b.kind == "stage"]
    opened = [b.text for b in stages if not b.again]
    assert len(opened) == len(set(opened))
    assert set(stage_names(task)) <= {*opened, task.name}
    assert all(not b.inside for b in stages if b.again)


def test_a_tree_shows_the_structure_of_the_task() -> None:
    def lines(branch: Branch, depth: int = 0) -> Iterator[str]:
        yield "  " * depth + branch.text
        for inner in branch.inside:
            yield from lines(inner, depth + 1)

    assert list(lines(outline(parse_task(RETRY)))) == [
        "dock",
        "  approach",
        "    converging(arm, satellite)",
        "  one of",
        "    captured",
        "      for 2 s",
        "        coupled(arm, satellite)",
        "    in turn",
        "      back_off",
        "        at least once",
        "          diverging(arm, satellite)",
        "      dock",
    ]


def test_clauses_are_children_of_their_action() -> None:
    stages_by_actor = {
        b.text: b.stage for b in walk(outline(parse_task(STRICT))) if b.kind == "actor"
    }
    assert stages_by_actor == {"arm": "coupled", "satellite": "coupled"}

"""The table of relations against a dumb twin that makes every record."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from visup.agent import Column, Mind, Relation, RelationTable, Truth
from visup.agent.model.relation_columns import ColumnLayout, RelationBlock
from visup.agent.storage.jsonable import to_jsonable

IDS = (2, 5, 9)
PAIRS = ((2, 5), (2, 9), (5, 9))


NAMES = (("closing", "steady"), ("left_of", "right_of"), ("", "seldom"))
COLUMNS = ColumnLayout(
    (
        Column(NAMES[0], (0, 0), 0, 1),
        Column(NAMES[1], (1, 2), 0, listed="one"),
        Column(NAMES[2], (3, 3), 0, listed="none"),
    )
)
STATE = np.array([[0, 1, -1], [0, 1, 0], [1, 0, 1], [1, 0, 1]], dtype=np.int8)
CELLS = RelationBlock(COLUMNS, STATE, np.full((4, 3), 3.0), np.array([[0.5] * 3, [7.0] * 3]))
TABLE = RelationTable(IDS, (CELLS,), (Relation("coupled", (2, 9), Truth.TRUE, 1.0),))


def test_a_table_lists_what_its_columns_list_and_what_was_given() -> None:
    told = [(r.name, r.objects, r.truth.value) for r in TABLE]
    assert told == [
        ("closing", (2, 5), "true"), ("steady", (2, 5), "false"), ("left_of", (2, 5), "true"),
        ("closing", (2, 9), "false"), ("steady", (2, 9), "true"), ("right_of", (2, 9), "true"),
        ("closing", (5, 9), "unknown"), ("steady", (5, 9), "unknown"), ("left_of", (5, 9), "true"),
        ("coupled", (2, 9), "true"),
    ]  # fmt: skip
    assert len(TABLE) == len(told)
    assert TABLE[-1].name == "coupled"
    assert [r.name for r in TABLE[:2]] == ["closing", "steady"]
    assert len(to_jsonable(TABLE)) == len(told)


@given(st.permutations(IDS), st.sampled_from(("closing", "steady", "seldom")))
def test_symmetric_relations_are_found_in_either_order(ids: list[int], name: str) -> None:
    a, b, _ = ids
    one, other = TABLE.find(name, a, b), TABLE.find(name, b, a)
    assert one is not None
    assert other is not None
    assert (one.truth, one.objects) == (other.truth, other.objects[::-1])


def test_order_counts_for_what_is_not_symmetric() -> None:
    for (a, b), name in zip(PAIRS, ("left_of", "right_of", "left_of"), strict=True):
        opposite = {"left_of": "right_of", "right_of": "left_of"}[name]
        for objects, wanted in (((a, b), name), ((b, a), opposite)):
            for asked in ("left_of", "right_of"):
                found = TABLE.find(asked, *objects)
                assert found is not None
                assert (found.truth is Truth.TRUE) == (asked == wanted)
                assert found.objects == objects


def test_relations_have_value_confidence_and_unknown() -> None:
    known, unknown = TABLE.find("closing", 2, 5), TABLE.find("closing", 5, 9)
    assert known == Relation("closing", (2, 5), Truth.TRUE, 3.0, 0.5, 7.0)
    assert unknown is not None
    assert (unknown.truth, unknown.confidence) == (Truth.UNKNOWN, 0.0)


@pytest.mark.parametrize(
    ("name", "objects"), [("closing", (2, 3)), ("no_such", (2, 5)), ("closing", (2,))]
)
def test_relations_that_are_not_evaluated_are_none(name: str, objects: tuple[int, ...]) -> None:
    assert TABLE.find(name, *objects) is None


def test_a_mind_finds_relations_in_a_table_and_in_a_tuple() -> None:
    near = (Relation("near", (5, 2), Truth.TRUE, 0.0),)
    mind = Mind(relations=TABLE + near)
    assert [r.objects for r in mind.holding("closing", "coupled", "near")] == [
        (2, 5),
        (2, 9),
        (5, 2),
    ]
    assert mind.relation("near", 2, 5) is mind.relation("near", 5, 2)
    given = Mind(relations=tuple(TABLE))
    assert given.holding("closing") == TABLE.holding("closing")
    assert tuple(TABLE) == TABLE
    assert {r.name for r in TABLE.all()} >= {"seldom", "left_of", "closing"}


@given(
    st.sampled_from(("closing", "steady", "left_of", "right_of", "seldom", "coupled", "other")),
    st.permutations((*IDS, 11)),
)
def test_a_truth_is_that_of_the_relation(name: str, ids: list[int]) -> None:
    found = TABLE.find(name, *ids[:2])
    assert TABLE.truth(name, *ids[:2]) is (None if found is None else found.truth)

"""Stretches and intervals lose nothing: what held at each step is read back from them."""

from __future__ import annotations

from itertools import combinations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from visup.agent import Relation, RelationTable, Truth
from visup.agent.model.relation_columns import Column, ColumnLayout, RelationBlock
from visup.archive.relation_intervals import RelationIntervals
from visup.archive.value_intervals import IntervalCollector, StepTime

values = st.lists(st.dictionaries(st.sampled_from("ab"), st.integers(0, 2)), max_size=12)


def times(count: int) -> list[StepTime]:
    return [StepTime(n, 3 * n, 0.5 * n) for n in range(count)]


@given(values)
def test_stretches_tell_each_value_of_each_step(steps: list[dict[str, int]]) -> None:
    stretches: IntervalCollector[str, int] = IntervalCollector()
    at = times(len(steps))
    for when, held in zip(at, steps, strict=True):
        stretches.add(when, held)
    found = stretches.finish(at[-1]) if at else []
    for number, held in enumerate(steps):
        covering = [s for s in found if s.begin.number <= number < s.begin.number + s.columns[3]]
        assert {s.key: s.value for s in covering} == held
        assert len(covering) == len(held)
    for one in found:  # each is as long as it can be
        later = [s for s in found if s.key == one.key and s.begin == one.end and not one.open]
        assert all(s.value != one.value for s in later)


LAYOUT = ColumnLayout(
    (
        Column(("nearing", "parting"), (0, 0), 0, 1),
        Column(("", "meeting"), (1, 1), 0),
        Column(("left_of", "right_of"), (2, 3), 0),
    )
)


@st.composite
def tables(draw: st.DrawFn) -> RelationTable:
    ids = tuple(sorted(draw(st.sets(st.integers(1, 4), max_size=4))))
    pairs = len(ids) * (len(ids) - 1) // 2
    codes = draw(st.lists(st.integers(-1, 1), min_size=4 * pairs, max_size=4 * pairs))
    state = np.array(codes, np.int8).reshape(4, pairs)
    numbers = np.round(np.abs(np.sin(1.0 + state[:2] + pairs)), 3)
    block = RelationBlock(LAYOUT, state, np.zeros(state.shape), numbers)
    given_too = draw(st.lists(st.sampled_from(list(Truth)), max_size=1))
    extra = tuple(Relation("plugged", (4, 2), truth, 0.0, 0.5) for truth in given_too)
    return RelationTable(ids, (block,), extra)


NAMES = ("nearing", "parting", "meeting", "left_of", "right_of", "plugged")


@given(st.lists(tables(), max_size=8))
def test_relations_are_read_back_from_their_intervals(steps: list[RelationTable]) -> None:
    intervals = RelationIntervals()
    at = times(len(steps))
    for when, table in zip(at, steps, strict=True):
        intervals.add(when, table)
    rows = intervals.finish()
    for number, table in enumerate(steps):
        held = {(r[0], r[1], r[2]): r[3] for r in rows if r[6] // 3 <= number < r[6] // 3 + r[7]}
        wanted = {}
        for a, b in (p for pair in combinations(range(1, 5), 2) for p in (pair, pair[::-1])):
            for name in NAMES:
                truth = table.truth(name, a, b) if is_kept(name, a, b) else None
                if truth in (Truth.TRUE, Truth.UNKNOWN):
                    wanted[name, a, b] = truth.value
        assert held == wanted
    lengths = [(r[4], r[5], r[7], r[8]) for r in rows]
    assert all(end == begin + 0.5 * (n - still) for begin, end, n, still in lengths)


def is_kept(name: str, a: int, b: int) -> bool:
    """Symmetric relations stand once, the smaller number first; those of plug-ins as they were given."""
    if name == "plugged":
        return (a, b) == (4, 2)
    return a < b or name in ("left_of", "right_of")


def test_the_lowest_confidence_and_the_range_of_values_are_kept() -> None:
    intervals = RelationIntervals()
    for when, (sure, value) in zip(times(3), [(0.9, 5.0), (0.4, 7.0), (0.8, 6.0)], strict=True):
        numbers = np.array([[sure], [value]])
        block = RelationBlock(LAYOUT, np.zeros((4, 1), np.int8), np.zeros((4, 1)), numbers)
        intervals.add(when, RelationTable((1, 2), (block,)))
    nearing = next(r for r in intervals.finish() if r[0] == "nearing")
    assert nearing == ("nearing", 1, 2, "true", 0.0, 1.0, 0, 3, True, 0.4, 5.0, 7.0)

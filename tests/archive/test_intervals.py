"""Intervals lose nothing: the values of each step can be read back from them."""

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
def test_intervals_have_each_value_of_each_step(steps: list[dict[str, int]]) -> None:
    collector: IntervalCollector[str, int] = IntervalCollector()
    step_times = times(len(steps))
    for time, expected in zip(step_times, steps, strict=True):
        collector.add(time, expected)
    intervals = collector.finish(step_times[-1]) if step_times else []
    for number, expected in enumerate(steps):
        covering = [
            s for s in intervals if s.begin.number <= number < s.begin.number + s.columns[3]
        ]
        assert {s.key: s.value for s in covering} == expected
        assert len(covering) == len(expected)
    for interval in intervals:  # each is as long as possible
        later = [
            s
            for s in intervals
            if s.key == interval.key and s.begin == interval.end and not interval.open
        ]
        assert all(s.value != interval.value for s in later)


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
    extra_truths = draw(st.lists(st.sampled_from(list(Truth)), max_size=1))
    extra = tuple(Relation("plugged", (4, 2), truth, 0.0, 0.5) for truth in extra_truths)
    return RelationTable(ids, (block,), extra)


NAMES = ("nearing", "parting", "meeting", "left_of", "right_of", "plugged")


@given(st.lists(tables(), max_size=8))
def test_relations_are_read_back_from_their_intervals(steps: list[RelationTable]) -> None:
    intervals = RelationIntervals()
    step_times = times(len(steps))
    for time, table in zip(step_times, steps, strict=True):
        intervals.add(time, table)
    rows = intervals.finish()
    for number, table in enumerate(steps):
        actual = {(r[0], r[1], r[2]): r[3] for r in rows if r[6] // 3 <= number < r[6] // 3 + r[7]}
        expected = {}
        for a, b in (p for pair in combinations(range(1, 5), 2) for p in (pair, pair[::-1])):
            for name in NAMES:
                truth = table.truth(name, a, b) if is_stored(name, a, b) else None
                if truth in (Truth.TRUE, Truth.UNKNOWN):
                    expected[name, a, b] = truth.value
        assert actual == expected
    lengths = [(r[4], r[5], r[7], r[8]) for r in rows]
    assert all(end == begin + 0.5 * (n - still) for begin, end, n, still in lengths)


def is_stored(name: str, a: int, b: int) -> bool:
    """Symmetric relations stand once, the smaller number first; those of plug-ins as given."""
    if name == "plugged":
        return (a, b) == (4, 2)
    return a < b or name in ("left_of", "right_of")


def test_intervals_have_the_lowest_confidence_and_range_of_values() -> None:
    intervals = RelationIntervals()
    for time, (confidence, value) in zip(
        times(3), [(0.9, 5.0), (0.4, 7.0), (0.8, 6.0)], strict=True
    ):
        numbers = np.array([[confidence], [value]])
        block = RelationBlock(LAYOUT, np.zeros((4, 1), np.int8), np.zeros((4, 1)), numbers)
        intervals.add(time, RelationTable((1, 2), (block,)))
    nearing = next(r for r in intervals.finish() if r[0] == "nearing")
    assert nearing == ("nearing", 1, 2, "true", 0.0, 1.0, 0, 3, True, 0.4, 5.0, 7.0)

"""Which of several tasks are going on: laws of the posterior."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from visup.tasks.supervision.task_inference import (
    ALONE,
    IDLE,
    MOST,
    SURE,
    TaskActivity,
    rivals,
    shares,
    updated_activities,
)

evidences = st.lists(st.floats(-MOST, MOST), min_size=1, max_size=5)
casts = st.lists(st.frozensets(st.integers(1, 5), max_size=3), min_size=1, max_size=6)
ONE = frozenset({1})


@given(evidences, st.booleans())
def test_shares_are_the_posterior(evidence: list[float], none: bool) -> None:
    result = shares(evidence, none)
    idle = IDLE * len(evidence) if none else 0.0
    total = sum(math.exp(e) for e in evidence) + idle
    assert result == pytest.approx([math.exp(e) / total for e in evidence])


@given(evidences, st.integers(0, 4), st.floats(0.1, 5))
def test_more_evidence_makes_a_task_likelier(
    evidence: list[float], index: int, more: float
) -> None:
    index %= len(evidence)
    better = [e + more * (k == index) for k, e in enumerate(evidence)]
    assert shares(better, none=True)[index] > shares(evidence, none=True)[index]


@given(casts)
def test_rivals_are_tasks_connected_by_common_objects(cast: list[frozenset[int]]) -> None:
    groups = list(rivals(cast))
    assert sorted(k for g in groups for k in g) == list(range(len(cast)))
    home = {k: g for g in groups for k in g}
    for a, first in enumerate(cast):
        for b, second in enumerate(cast):
            assert not first & second or home[a] == home[b]
    for group in groups:
        connected = {group[0]}
        for _ in group:
            connected |= {k for k in group if any(cast[k] & cast[s] for s in connected)}
        assert connected == set(group)


@given(st.floats(-99, 99), st.floats(0, 9))
def test_a_single_task_is_active(gain: float, dt: float) -> None:
    assert updated_activities([TaskActivity()], [gain], [ONE], dt) == (ALONE,)


def test_without_evidence_neither_of_two_tasks_is_reported() -> None:
    activities = updated_activities([TaskActivity(), TaskActivity()], [0.0, 0.0], [ONE, ONE], 0.1)
    assert [a.reportable for a in activities] == [False, False]


@given(st.lists(st.tuples(st.floats(-2, 2), st.floats(-2, 2)), min_size=1, max_size=60))
def test_once_a_task_is_reported_one_of_its_rivals_stays_so(
    gains: list[tuple[float, float]],
) -> None:
    now: tuple[TaskActivity, ...] = (TaskActivity(), TaskActivity())
    for pair in gains:
        before = now
        now = updated_activities(before, pair, [ONE, ONE], 0.1)
        assert all(abs(a.evidence) <= MOST for a in now)
        if before[0].begun:
            assert sum(a.chance for a in now) == pytest.approx(1.0)
            assert any(a.reportable for a in now)
        assert now[0].begun == (before[0].begun or sum(a.chance for a in now) >= SURE)


def test_a_rival_that_explains_the_observations_takes_over() -> None:
    now: tuple[TaskActivity, ...] = (TaskActivity(), TaskActivity())
    for _ in range(20):
        now = updated_activities(now, [0.5, 0.5], [ONE, ONE], 0.2)
    assert [a.reportable for a in now] == [True, True]
    for _ in range(20):
        now = updated_activities(now, [-0.5, 0.5], [ONE, ONE], 0.2)
    assert [a.reportable for a in now] == [False, True]


def test_evidence_that_no_rival_explains_does_not_change_the_task() -> None:
    now: tuple[TaskActivity, ...] = (TaskActivity(MOST, 0.5, True), TaskActivity(MOST, 0.5, True))
    for _ in range(50):
        now = updated_activities(now, [-0.5, -0.1], [ONE, ONE], 0.1)
    assert [a.chance for a in now] == pytest.approx([0.5, 0.5])


def test_tasks_without_a_common_object_do_not_compete() -> None:
    now: tuple[TaskActivity, ...] = (TaskActivity(), TaskActivity())
    for _ in range(20):
        now = updated_activities(now, [0.5, 0.5], [ONE, frozenset({2})], 0.2)
    assert all(a.chance > SURE for a in now)


def test_rivals_of_a_task_that_ended_start_again() -> None:
    now: tuple[TaskActivity, ...] = (TaskActivity(MOST, 0.5, True), TaskActivity(MOST, 0.5, True))
    now = updated_activities(now, [0.0, -0.1], [ONE, ONE], 0.1, [True, False])
    assert now[0].ended
    assert now[0].chance == 1.0
    assert not now[1].begun
    assert not now[1].reportable
    later = updated_activities(now, [0.0, 3.0], [ONE, ONE], 0.1, [True, False])
    assert later[0] == now[0]
    assert later[1].chance > now[1].chance


def test_evidence_fades() -> None:
    first = (TaskActivity(MOST, 1.0, True), TaskActivity(0.0, 0.0, True))
    later = updated_activities(first, [0.0, 0.0], [ONE, ONE], 60.0)
    assert later[0].evidence == pytest.approx(MOST * math.exp(-3))

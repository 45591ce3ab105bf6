from __future__ import annotations

from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st

from visup.agent import Event
from visup.evaluation.machines.recorder import (
    MAX_BRIDGED_S,
    MIN_INTERVAL_S,
    IntervalLog,
    reported_stages,
)


def stage_event(kind: str, stage: str, time: float) -> Event:
    return Event(f"stage_{kind}", time, round(25 * time), ".", data={"stage": stage})


def test_a_stage_has_the_time_of_its_first_report_and_the_outcome_of_its_last() -> None:
    events = [
        stage_event("started", "reach", 1.0),
        stage_event("failing", "reach", 2.0),
        stage_event("progressing", "reach", 3.0),
        stage_event("started", "grasp", 4.0),
        stage_event("failing", "grasp", 5.0),
    ]
    reported = [(s.stage, s.time, s.outcome) for s in reported_stages(events)]
    assert reported == [("reach", 1.0, "complete"), ("grasp", 4.0, "failing")]


def test_a_stage_that_begins_again_counts_as_another() -> None:
    events = [stage_event("started", "reach", 1.0), stage_event("failed", "reach", 2.0)]
    reported = reported_stages([*events, stage_event("started", "reach", 3.0)])
    assert [s.outcome for s in reported] == ["failing", "complete"]


def test_a_stalled_stage_is_failing_until_it_progresses() -> None:
    stalled = [stage_event("started", "ride", 1.0), stage_event("stalled", "ride", 4.0)]
    resumed = [*stalled, stage_event("progressing", "ride", 5.0)]
    assert [reported_stages(e)[0].outcome for e in (stalled, resumed)] == ["failing", "complete"]


def test_the_stage_in_which_a_task_is_interrupted_is_unsafe() -> None:
    events = [stage_event("started", "reach", 1.0), stage_event("started", "grasp", 2.0)]
    assert [s.outcome for s in reported_stages(events, "grasp")] == ["complete", "unsafe"]


@given(st.lists(st.integers(0, 400), unique=True))
def test_intervals_are_long_enough_and_apart(moments: list[int]) -> None:
    log = IntervalLog()
    for n in sorted(moments):
        log.add(("a",), n / 25)
    intervals = log.intervals()
    assert all(i.to_s - i.from_s >= MIN_INTERVAL_S for i in intervals)
    assert all(b.from_s - a.to_s > MAX_BRIDGED_S for a, b in pairwise(intervals))

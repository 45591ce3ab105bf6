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


def said(kind: str, stage: str, time: float) -> Event:
    return Event(f"stage_{kind}", time, round(25 * time), ".", data={"stage": stage})


def test_a_stage_counts_from_when_it_was_told_and_ends_with_the_last_word() -> None:
    events = [
        said("started", "reach", 1.0),
        said("failing", "reach", 2.0),
        said("progressing", "reach", 3.0),
        said("started", "grasp", 4.0),
        said("failing", "grasp", 5.0),
    ]
    told = [(s.stage, s.time, s.outcome) for s in reported_stages(events)]
    assert told == [("reach", 1.0, "complete"), ("grasp", 4.0, "failing")]


def test_a_stage_that_begins_again_is_another_one() -> None:
    events = [said("started", "reach", 1.0), said("failed", "reach", 2.0)]
    told = reported_stages([*events, said("started", "reach", 3.0)])
    assert [s.outcome for s in told] == ["failing", "complete"]


def test_what_makes_no_progress_is_not_complete_until_it_goes_on() -> None:
    stuck = [said("started", "ride", 1.0), said("stalled", "ride", 4.0)]
    on = [*stuck, said("progressing", "ride", 5.0)]
    assert [reported_stages(e)[0].outcome for e in (stuck, on)] == ["failing", "complete"]


def test_the_stage_in_which_a_task_is_interrupted_is_unsafe() -> None:
    events = [said("started", "reach", 1.0), said("started", "grasp", 2.0)]
    assert [s.outcome for s in reported_stages(events, "grasp")] == ["complete", "unsafe"]


@given(st.lists(st.integers(0, 400), unique=True))
def test_intervals_cover_what_lasts_and_are_apart(moments: list[int]) -> None:
    log = IntervalLog()
    for n in sorted(moments):
        log.add(("a",), n / 25)
    found = log.intervals()
    assert all(i.to_s - i.from_s >= MIN_INTERVAL_S for i in found)
    assert all(b.from_s - a.to_s > MAX_BRIDGED_S for a, b in pairwise(found))

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.agent.scripted import Scripted, frames
from visup.agent import Percept, Region, ReportState
from visup.agent.execution.behaviour_slot import FAILURES_BEFORE_SUSPENSION, FIRST_SUSPENSION_S
from visup.agent.execution.pipeline import ordered_slots, perceive
from visup.agent.model.errors import BehaviourError


@given(st.permutations(["a", "b", "c", "d"]))
def test_behaviours_run_after_the_providers_of_their_needs(order: list[str]) -> None:
    needs = {"a": (), "b": ("A",), "c": ("B",), "d": ("A", "C")}
    slots = ordered_slots([Scripted(n, (n.upper(),), needs=needs[n]) for n in order])
    placed = [s.behaviour.contract.name for s in slots]
    for name, kinds in needs.items():
        assert all(placed.index(k.lower()) < placed.index(name) for k in kinds)


@pytest.mark.parametrize(
    ("behaviours", "message"),
    [
        ([Scripted("a", ("x",)), Scripted("a", ("y",))], "two behaviours are called 'a'"),
        ([Scripted("a", ("x",), needs=("y",))], "needs 'y', which no behaviour gives"),
        (
            [Scripted("a", ("x",), needs=("y",)), Scripted("b", ("y",), needs=("x",))],
            "wait for each other in a circle: ",
        ),
    ],
)
def test_cyclic_or_unmet_needs_are_refused_with_a_message(
    behaviours: list[Scripted], message: str
) -> None:
    with pytest.raises(BehaviourError, match=message):
        ordered_slots(behaviours)


def test_a_behaviour_that_raises_is_reported_and_its_kind_is_unknown() -> None:
    def says(_: int) -> object:
        raise ValueError("no light")

    slots = ordered_slots([Scripted("good", ("x",)), Scripted("bad", ("y",), says)])
    seen = perceive(slots, next(frames(1)), ())
    states = {r.behaviour: (r.state, r.error) for r in seen.reports}
    assert states["good"][0] is ReportState.RAN
    assert states["bad"] == (ReportState.FAILED, "ValueError: no light")
    assert seen.observed("x")
    assert not seen.observed("y")


def test_a_behaviour_rests_if_its_needs_were_not_observed() -> None:
    def says(_: int) -> object:
        raise ValueError("no light")

    slots = ordered_slots([Scripted("eye", ("x",), says), Scripted("namer", ("y",), needs=("x",))])
    seen = perceive(slots, next(frames(1)), ())
    assert [r.state for r in seen.reports] == [ReportState.FAILED, ReportState.BLIND]
    assert not seen.observed("y")


@pytest.mark.parametrize(
    ("report", "message"),
    [
        (Percept("other", 1, 0.0, "liar"), "reported 'other'"),
        ("a string", "reported a str"),
    ],
)
def test_a_report_outside_the_contract_is_a_failure(report: Any, message: str) -> None:
    liar = Scripted("liar", ("x",))
    liar.perceive = lambda *_: [report]  # type: ignore[method-assign]
    seen = perceive(ordered_slots([liar]), next(frames(1)), ())
    assert seen.reports[0].state is ReportState.FAILED
    assert message in seen.reports[0].error
    assert not seen.reports[0].percepts


def test_repeated_failures_suspend_and_a_success_resets_the_count() -> None:
    def says(i: int) -> object:
        if i < 20:
            raise ValueError("not yet")
        return i

    slots = ordered_slots([Scripted("slow", ("x",), says)])
    states = [perceive(slots, f, ()).reports[0].state for f in frames(60)]
    assert states[:FAILURES_BEFORE_SUSPENSION] == [ReportState.FAILED] * FAILURES_BEFORE_SUSPENSION
    rest = round(FIRST_SUSPENSION_S * 10)
    assert states[FAILURES_BEFORE_SUSPENSION : FAILURES_BEFORE_SUSPENSION + rest - 1] == [
        ReportState.SUSPENDED
    ] * (rest - 1)
    assert states[-1] is ReportState.RAN
    assert slots[0].failures == 0


def test_a_behaviour_runs_no_more_often_than_every_s() -> None:
    slots = ordered_slots([Scripted("lazy", ("x",), every_s=0.5)])
    ran = [
        f.index for f in frames(20) if perceive(slots, f, ()).reports[0].state is ReportState.RAN
    ]
    assert ran == [0, 5, 10, 15]


@pytest.mark.parametrize(
    "bbox", [(-1, 0, 2, 2), (5, 0, 2, 2), (0, 3, 2, 2), (0, 0, 3, 2), (0, 0, 0, 2)]
)
def test_a_region_that_is_not_in_the_image_is_a_failure(bbox: tuple[int, int, int, int]) -> None:
    region = Region(1, bbox, np.ones((2, 2), bool), np.zeros((0, 2), np.float32), (0, 0), 4)
    seen = perceive(
        ordered_slots([Scripted("eye", ("region",), lambda _: region)]), next(frames(1)), ()
    )
    assert seen.reports[0].state is ReportState.FAILED
    assert "region 1" in seen.reports[0].error

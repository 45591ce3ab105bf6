"""What comes of behaviours that hang, end themselves, are slow, leak, or fail now and then."""

from __future__ import annotations

import mmap
import threading
import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest

from tests.agent.scripted import Scripted, frames
from visup.agent import Contract, Directive, Frame, Observation, Report, ReportState
from visup.agent.contract.contract import COMPILING_HANG_S
from visup.agent.contract.limits import Limits
from visup.agent.cycle.agent import Agent
from visup.agent.execution.behaviour_slot import FAILURES_BEFORE_SUSPENSION
from visup.agent.execution.pipeline import ordered_slots, perceive
from visup.agent.model.errors import BehaviourError
from visup.agent.model.step import Step
from visup.percepts.motion.behaviour import MotionBehaviour


class FunctionBehaviour:
    """A behaviour that calls a function of frame and observation."""

    def __init__(self, does: Callable[[Frame, Observation], Any], **declared: Any) -> None:
        self.contract = Contract("plug", gives=("x",), **declared)
        self.does = does

    def perceive(
        self, frame: Frame, observation: Observation, directives: Sequence[Directive]
    ) -> Any:
        said = self.does(frame, observation)
        return [] if said is None else [self.contract.percept(frame, said)]


def reports(plug: FunctionBehaviour, limits: Limits, count: int, fps: float = 10.0) -> list[Report]:
    return [s.reports[0] for s in Agent([plug], limits=limits).steps(frames(count, fps))]


def on_frame(index: int, does: Callable[[], Any]) -> Callable[[Frame, Observation], Any]:
    return lambda frame, seen: does() if frame.index == index else frame.index


def loop_forever() -> None:
    while True:
        pass


def exit_process() -> None:
    raise SystemExit(3)


def interrupt() -> None:
    raise KeyboardInterrupt


class Unreadable(Exception):
    def __str__(self) -> str:
        raise RuntimeError


def raise_unprintable() -> None:
    raise Unreadable


@pytest.mark.parametrize("does", [loop_forever, lambda: time.sleep(0.6)])
def test_a_hang_costs_its_limit_once_and_the_step_continues(does: Callable[[], Any]) -> None:
    before = threading.active_count()
    begin = time.monotonic()
    found = reports(FunctionBehaviour(on_frame(1, does)), Limits(hang_s=0.2), 40)
    assert time.monotonic() - begin < 5.0
    assert [r.state for r in found[:2]] == [ReportState.RAN, ReportState.LATE]
    assert found[1].error == "it gave no answer within 200 ms"
    assert all(r.state is not ReportState.RAN for r in found[1:11])
    deadline = time.monotonic() + 10
    while threading.active_count() > before and time.monotonic() < deadline:
        time.sleep(0.02)
    assert threading.active_count() <= before  # what was given up ends, and so do idle threads


def test_a_behaviour_that_recovers_from_a_hang_runs_again() -> None:
    found = reports(FunctionBehaviour(on_frame(1, loop_forever)), Limits(hang_s=0.2), 40)
    assert found[-1].state is ReportState.RAN
    assert found[-1].percepts[0].value == 39


@pytest.mark.parametrize(
    ("does", "said"),
    [
        (exit_process, "it called for an exit (SystemExit)"),
        (interrupt, "it called for an exit (KeyboardInterrupt)"),
        (raise_unprintable, "Unreadable: (its message cannot be read)"),
    ],
)
def test_an_exit_of_a_plug_in_does_not_end_the_supervisor(
    does: Callable[[], Any], said: str
) -> None:
    found = reports(FunctionBehaviour(on_frame(1, does)), Limits(), 4)
    assert [r.state for r in found] == [ReportState.RAN, ReportState.FAILED] + [ReportState.RAN] * 2
    assert said in found[1].error


def test_an_exit_is_contained_in_the_thread_of_the_caller_too() -> None:
    found = reports(FunctionBehaviour(on_frame(1, exit_process)), Limits(hang_s=None), 4)
    assert [r.state.value for r in found] == ["ran", "failed", "ran", "ran"]


def test_percepts_are_the_same_with_and_without_threads() -> None:
    def run(limits: Limits) -> list[Step]:
        behaviours = [Scripted("eye", ("x",)), Scripted("namer", ("y",), needs=("x",))]
        return list(Agent(behaviours, limits=limits).steps(frames(20)))

    threaded, direct = run(Limits()), run(Limits(hang_s=None))
    assert [s.reports for s in threaded] == [s.reports for s in direct]


def test_without_budgets_no_decision_depends_on_time() -> None:
    ticks = iter(range(0, 10**6, 1000))  # a clock by which every run takes for ever
    limits = Limits(hang_s=None, clock=lambda: float(next(ticks)))
    found = reports(FunctionBehaviour(lambda f, s: f.index, cost_ms=1.0), limits, 10)
    assert {r.state for r in found} == {ReportState.RAN}


def test_a_contract_may_extend_the_hang_limit_except_live() -> None:
    slow, usual = Contract("slow", ("x",), hang_s=600.0), Contract("usual", ("x",))
    assert MotionBehaviour.contract.hang_s == COMPILING_HANG_S
    recorded, live = Limits(hang_s=60.0), Limits(hang_s=20.0, longer_hangs=False)
    assert [recorded.seconds(slow), recorded.seconds(usual)] == [600.0, 60.0]
    assert [live.seconds(slow), live.seconds(usual)] == [20.0, 20.0]
    assert Limits(hang_s=None).seconds(slow) is None
    assert Limits(budgets=True, budget_ms=40.0).seconds(slow) == 0.04
    with pytest.raises(BehaviourError, match="a number above 0"):
        Contract("slow", ("x",), hang_s=-1.0)


def test_a_run_over_budget_is_late_and_repeated_ones_suspend() -> None:
    now = [0.0]

    def slow(frame: Frame, observation: Observation) -> int:
        now[0] += 0.05
        return frame.index

    limits = Limits(hang_s=None, budgets=True, clock=lambda: now[0])
    found = reports(FunctionBehaviour(slow, cost_ms=40.0), limits, 8)
    assert [r.state for r in found[:FAILURES_BEFORE_SUSPENSION]] == [
        ReportState.LATE
    ] * FAILURES_BEFORE_SUSPENSION
    assert {r.state for r in found[FAILURES_BEFORE_SUSPENSION:]} == {ReportState.SUSPENDED}
    assert found[0].error == "it took longer than its budget of 40 ms"
    assert {r.state for r in reports(FunctionBehaviour(slow, cost_ms=60.0), limits, 8)} == {
        ReportState.RAN
    }


def test_kinds_of_a_failed_behaviour_stay_unknown_until_it_has_run_again() -> None:
    def fails(frame: Frame, observation: Observation) -> int:
        if frame.index == 5:
            raise ValueError("no light")
        return frame.index

    slots = ordered_slots([FunctionBehaviour(fails, every_s=0.5)])
    seen = [perceive(slots, frame, ()) for frame in frames(12)]
    assert ["x" in s.unknown for s in seen] == [5 <= i < 10 for i in range(12)]
    assert [s.reports[0].state for s in seen[:2]] == [ReportState.RAN, ReportState.RESTED]


def test_kinds_of_a_blind_behaviour_are_unknown() -> None:
    def fails(_: int) -> object:
        raise ValueError("no light")

    chain = [Scripted("a", ("A",), fails), Scripted("b", ("B",), needs=("A",))]
    seen = perceive(
        ordered_slots([*chain, Scripted("c", ("C",), needs=("B",))]), next(frames(1)), ()
    )
    assert seen.unknown == {"A", "B", "C"}
    assert [r.state.value for r in seen.reports] == ["failed", "blind", "blind"]


def test_a_kind_is_unknown_if_one_of_its_two_providers_failed() -> None:
    def fails(_: int) -> object:
        raise ValueError("no light")

    both = [Scripted("a", ("x",)), Scripted("b", ("x",), fails)]
    seen = perceive(ordered_slots(both), next(frames(1)), ())
    assert seen.of("x") == (0,)
    assert not seen.observed("x")


def test_retained_memory_exceeds_the_limit() -> None:
    kept: list[Any] = []

    def hoard(frame: Frame, observation: Observation) -> int:
        # Pages of its own: the allocator may hand out memory that earlier tests have left resident.
        block = np.frombuffer(mmap.mmap(-1, 8 * 2**20), np.uint8)
        block[:] = 1
        kept.append(block)
        return frame.index

    found = reports(FunctionBehaviour(hoard, memory_mb=30.0), Limits(), 12)
    kept.clear()
    first = next(i for i, r in enumerate(found) if r.state is ReportState.FAILED)
    assert 3 <= first <= 6
    assert "grow by more than 30 MB" in found[first].error
    assert found[first + 1].state is ReportState.SUSPENDED


def test_memory_freed_by_others_does_not_offset_growth() -> None:
    others = [np.ones(200 * 2**20, np.uint8)]
    kept: list[Any] = []

    def hoard(frame: Frame, observation: Observation) -> int:
        others.clear()
        if frame.index:
            kept.append(np.ones(40 * 2**20, np.uint8))
        return frame.index

    found = reports(FunctionBehaviour(hoard, memory_mb=30.0), Limits(), 2)
    assert found[0].state is ReportState.RAN
    assert found[1].state is ReportState.FAILED


def test_a_frame_cannot_be_written_to() -> None:
    def scribble(frame: Frame, observation: Observation) -> None:
        frame.image[:] = 0

    given = list(frames(3))
    agent = Agent([FunctionBehaviour(scribble)])
    found = [agent.step(frame).reports[0] for frame in given]
    assert all("read-only" in r.error for r in found)
    assert [int(f.image[0, 0, 0]) for f in given] == [0, 1, 2]


def test_the_past_has_the_requested_length_and_is_private() -> None:
    def past(frame: Frame, observation: Observation) -> list[int]:
        assert all(p.observation.frame_index == p.frame.index for p in observation.past)
        return [p.frame.index for p in observation.past]

    steps = list(Agent([FunctionBehaviour(past, history=2)]).steps(frames(4)))
    assert [s.observation.of("x")[0] for s in steps] == [[], [0], [0, 1], [1, 2]]
    assert all(s.observation.past == () for s in steps)


def test_a_clock_set_back_delays_no_behaviour() -> None:
    image = np.zeros((4, 6, 3), np.uint8)
    slots = ordered_slots([FunctionBehaviour(lambda f, s: f.index, every_s=10.0)])
    times = [100.0, 101.0, 3.0]
    states = [perceive(slots, Frame(i, t, image), ()).reports[0].state for i, t in enumerate(times)]
    assert states == [ReportState.RAN, ReportState.RESTED, ReportState.RAN]


def test_the_method_start_is_called_once_before_the_first_run() -> None:
    class Opened(FunctionBehaviour):
        opened = 0

        def start(self) -> None:
            self.opened += 1

    plug = Opened(lambda f, s: f.index)
    assert {r.state for r in reports(plug, Limits(), 3)} == {ReportState.RAN}
    assert plug.opened == 1


def test_a_start_that_fails_is_tried_again() -> None:
    class Reluctant(FunctionBehaviour):
        tries = 0

        def start(self) -> None:
            self.tries += 1
            if self.tries < 3:
                raise OSError("the device is busy")

    found = reports(Reluctant(lambda f, s: f.index), Limits(), 4)
    assert [r.state.value for r in found] == ["failed", "failed", "ran", "ran"]
    assert found[0].error == "OSError: the device is busy"

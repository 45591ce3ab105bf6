"""Laws of going forth and back: the same steps whatever the way."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.agent.scripted import COUNTING, Scripted, counting, exploding_at, frames
from tests.stepping.timelines import (
    COUNT,
    plain_agent,
    plain_course,
    plain_stepper,
    reasoning_bytes,
    reasoning_stepper,
    told,
)
from visup.agent import Frame
from visup.agent.contract.phases import Phase
from visup.agent.cycle.agent import Agent, Reasoners
from visup.agent.model.errors import SettingsError
from visup.agent.model.step import Step
from visup.stepping import Bookmark, Stepper


@dataclass(frozen=True)
class Own:
    """A plug-in's value of a kind of its own."""

    number: int


MOVES = st.lists(
    st.one_of(
        st.tuples(st.just("step"), st.integers(1, 15)),
        st.tuples(st.just("back"), st.integers(1, 20)),
        st.tuples(st.just("go"), st.integers(0, COUNT)),
        st.tuples(st.just("phase"), st.sampled_from(list(Phase))),
        st.tuples(st.just("branch"), st.integers(0, 9)),
        st.tuples(st.just("mark"), st.just(0)),
        st.tuples(st.just("return"), st.just(0)),
    ),
    min_size=1,
    max_size=12,
)


@given(moves=MOVES)
@settings(max_examples=25, deadline=None)
def test_every_path_to_a_step_gives_the_same_step(
    moves: Sequence[tuple[str, int | Phase]],
) -> None:
    it, marks = plain_stepper(), list[Bookmark]()
    for move, much in moves:
        walk(it, move, much, marks)
        if it.at and it.paused is None:
            assert told(it.last) == plain_course()[it.at - 1]
            assert it.mind is it.agent.mind
    it.go(it.made)
    for step in it.step(COUNT).steps:
        assert told(step) == plain_course()[step.frame_index]
    assert it.at == COUNT


def walk(it: Stepper, move: str, much: int | Phase, marks: list[Bookmark]) -> None:
    match move, much:
        case ["step", int()]:
            it.step(much)
        case ["back", int()]:
            it.back(min(much, it.at + (it.paused is not None)))
        case ["go", int()]:
            it.go(much)
        case ["phase", Phase()]:
            it.step(until=much)
        case ["branch", int()]:
            it.branch().step(much)
        case ["mark", _]:
            marks.append(it.snapshot())
        case _ if marks:
            mark = marks[-1]
            it.restore(mark)
            assert it.at == mark.number


def test_stepping_back_and_forth_reproduces_all_state() -> None:
    it, course = reasoning_stepper(), reasoning_bytes()
    it.step(COUNT)
    for number in (COUNT - 1, 31, 8, 7, 1):
        assert told(it.go(number)) == course[number - 1]
        assert tuple(told(s) for s in it.step(5).steps) == course[number : number + 5]
        it.go(COUNT)


def test_stepping_back_does_not_affect_behaviours() -> None:
    it = plain_stepper()
    it.step(30)
    it.back(25)
    it.branch().step(40)  # looks ahead, up to step 45
    it.step(COUNT)
    eye = it.agent.behaviours[0]
    alone = plain_agent()
    alone.run(frames(COUNT))
    assert eye.directives == alone.behaviours[0].directives  # type: ignore[attr-defined]


def test_observers_receive_each_step_once() -> None:
    seen: list[int] = []

    def observer(step: Step, frame: Frame) -> None:
        assert step.frame_index == frame.index
        seen.append(frame.index)

    it = plain_stepper()
    it.agent.observers = (observer,)
    it.step(20)
    it.back(10)
    it.branch().step(25)
    it.step(until="match")
    it.step(COUNT)
    assert seen == list(range(COUNT))


@pytest.mark.parametrize("phase", list(Phase))
def test_an_unfinished_step_can_be_inspected_finished_or_left(phase: Phase) -> None:
    it = plain_stepper()
    it.step(3)
    stopped = it.step(until=phase)
    assert stopped.reasons == (f"after {phase.value}",)
    if phase is Phase.ACT:
        assert (it.at, it.paused) == (4, None)
        return
    assert it.at == 3
    assert it.paused is not None
    assert it.paused.phase is phase
    counted = it.mind.recall(COUNTING)
    assert counted == (3 if phase is Phase.PERCEIVE else 4)
    assert it.agent.mind.recall(COUNTING) == 3
    assert told(it.step().step) == plain_course()[3]
    it.step(until=phase)
    assert told(it.back()) == plain_course()[3]
    assert it.paused is None


def test_a_failing_reasoner_is_visible_inside_its_step() -> None:
    it = Stepper(Agent([], Reasoners(update=(counting, exploding_at(2)))), frames(5))
    it.step(2)
    stopped = it.step(until="update")
    assert stopped.paused is not None
    assert stopped.paused.outcome is not None
    assert [c.kind for c in stopped.paused.outcome.conditions] == ["reasoning_failed"]
    step = it.step().step
    assert step is not None
    assert [a.kind for a in step.mind.alerts] == ["reasoning_failed"]


def test_the_end_is_reported_and_the_beginning_can_be_reached() -> None:
    it = plain_stepper(4)
    stopped = it.step(10)
    assert (stopped.taken, stopped.ended, it.at) == (4, True, 4)
    assert it.back(4) is None
    assert it.mind.frame_index == -1
    with pytest.raises(SettingsError, match="there is no step to go back"):
        it.back()
    with pytest.raises(SettingsError, match="there is no step 9"):
        it.go(9)
    assert it.at == 0


def test_an_answer_is_kept_when_stepping_back_over_it() -> None:
    it = reasoning_stepper()
    it.step(30)
    it.answer(1, "arm")
    it.back(4)
    with pytest.raises(SettingsError, match="later steps were taken"):
        it.answer(2, "arm")
    it.step(4)
    first = it.step().step
    it.back(3)
    again = it.step(3).step
    assert first is not None
    assert [e.kind for e in first.events][:1] == ["answer"]
    assert told(first) == told(again)


def test_a_snapshot_belongs_to_its_timeline() -> None:
    it = plain_stepper()
    it.step(5)
    with pytest.raises(SettingsError, match="another timeline"):
        it.branch().restore(it.snapshot())


def test_go_to_time_finds_the_step() -> None:
    it = plain_stepper()
    for seconds, frame in ((2.0, 20), (0.45, 5), (0.0, 0), (3.3, 33)):
        it.go_to_time(seconds)
        assert it.mind.frame_index == frame
    with pytest.raises(SettingsError, match="the source ends before 99 s"):
        it.go_to_time(99.0)
    assert it.mind.frame_index == 33


def test_values_the_codec_does_not_support_are_stored_unchanged() -> None:
    it = Stepper(Agent([Scripted("eye", ("x",), Own)]), frames(30), spacing=10, latest=1)
    it.step(25)
    step = it.at_step(7)
    assert step is not None
    assert step.observation.of("x") == (Own(6),)

"""Conditions stop at exactly the steps at which an evaluation of every step says that they should."""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import cache

import pytest

from tests.stepping.timelines import plain_stepper, reasoning_course, reasoning_stepper
from visup.agent import Mind, Truth
from visup.agent.model.errors import RuleError, SettingsError, VisupError
from visup.agent.model.step import Step
from visup.rules.predicates.snapshot import Snapshot
from visup.rules.safety.queries import explain
from visup.stepping import parse_condition

LONG = 100
Scan = Callable[[Step | None, Step], bool]


def of_kind(kind: str) -> Scan:
    return lambda before, step: any(e.kind == kind for e in step.events)


def when(holds: Callable[[Mind], bool]) -> Scan:
    """Becomes so."""
    return lambda before, step: holds(step.mind) and not (before is not None and holds(before.mind))


def changes(value: Callable[[Mind], object], nothing: object = None) -> Scan:
    return lambda before, step: (
        value(step.mind) != (nothing if before is None else value(before.mind))
    )


def unexpected(mind: Mind, object_id: int) -> Truth | None:
    if object_id not in Snapshot(mind).ids:
        return Truth.UNKNOWN
    return explain(mind, "unexpected_object", object_id).verdict


def any_becomes_unexpected(before: Step | None, step: Step) -> bool:
    def was(i: int) -> Truth | None:
        return Truth.UNKNOWN if before is None else unexpected(before.mind, i)

    return any(
        unexpected(step.mind, i) is Truth.TRUE and was(i) is not Truth.TRUE for i in (1, 2, 3)
    )


def any_changes(before: Step | None, step: Step) -> bool:
    def was(i: int) -> Truth | None:
        return Truth.UNKNOWN if before is None else unexpected(before.mind, i)

    return any(unexpected(step.mind, i) is not was(i) for i in (1, 2, 3))


def stage(name: str) -> Callable[[Mind], object]:
    return lambda mind: [
        (s.status.value, t.current == name) for t in mind.tasks for s in t.stages if s.stage == name
    ]


def presence(mind: Mind) -> object:
    belief = mind.objects.get(1)
    return None if belief is None else (belief.name, belief.presence)


def holds(name: str, a: int, b: int) -> Callable[[Mind], bool]:
    def evaluate(mind: Mind) -> bool:
        here = {x.id for x in mind.present()}
        found = mind.relation(name, a, b) if {a, b} <= here else None
        return found is not None and found.truth is Truth.TRUE

    return evaluate


SCANS: dict[str, Scan] = {
    "entry": of_kind("entry"),
    "event identified": of_kind("identified"),
    "alert": of_kind("alert"),
    "stage_failing": of_kind("stage_failing"),
    "rule unexpected_object": any_becomes_unexpected,
    "rule unexpected_object changes": any_changes,
    "stage approach": changes(stage("approach"), [("pending", False)]),
    "object 1": changes(presence),
    "2.0": lambda before, step: step.frame_index == 50,
    "frame 17": lambda before, step: step.frame_index == 17,
    "when diverging(1, 3)": when(holds("diverging", 1, 3)),
    "keeping_distance(2, 1)": when(holds("keeping_distance", 2, 1)),
    "phase act": lambda before, step: True,
}


def scanned(scan: Scan) -> list[int]:
    course = reasoning_course(LONG)
    before = (None, *course[:-1])
    return [s.frame_index for b, s in zip(before, course, strict=True) if scan(b, s)]


@cache
def stopped_at() -> dict[str, list[int]]:
    """The frames at which each of `SCANS` stops a run, all set as breakpoints of one run."""
    it = reasoning_stepper(LONG)
    numbers = {it.break_at(text).id: text for text in SCANS}
    found: dict[str, list[int]] = {text: [] for text in SCANS}
    while not (stopped := it.step(LONG)).ended:
        assert stopped.step is not None
        for reason in stopped.reasons:
            number = re.match(r"breakpoint (\d+): .", reason)
            assert number is not None
            found[numbers[int(number[1])]].append(stopped.step.frame_index)
    return found


@pytest.mark.parametrize("text", list(SCANS))
def test_a_condition_stops_where_a_scan_says(text: str) -> None:
    expected = scanned(SCANS[text])
    assert expected, "the scene does not show this"
    assert stopped_at()[text] == expected


@pytest.mark.parametrize("text", ["alert", "stage approach", "when diverging(1, 3)"])
def test_until_and_breakpoints_stop_at_the_same_steps(text: str) -> None:
    it, frames = reasoning_stepper(LONG), []
    while not (stopped := it.step(until=text)).ended:
        assert stopped.step is not None
        frames.append(stopped.step.frame_index)
    assert frames == stopped_at()[text]


def test_breakpoints_stop_in_every_run_and_again_after_going_back() -> None:
    it = reasoning_stepper(LONG)
    it.break_at("alert")
    it.break_at("frame 5")
    first = [it.step(LONG).step for _ in range(2)]
    it.go(0)
    again = [it.step(LONG).step for _ in range(2)]
    assert [s and s.frame_index for s in first] == [s and s.frame_index for s in again] == [5, 15]
    assert [b.hits for b in it.breakpoints.values()] == [2, 2]


def test_disabled_and_deleted_breakpoints_do_not_stop() -> None:
    it = plain_stepper()
    it.break_at("frame 5")
    other = it.break_at(lambda step: step.frame_index == 8)
    it.enable(1, False)
    assert it.step(50).taken == 9
    it.enable(1)
    it.delete(other.id)
    it.go(0)
    assert it.step(50).taken == 6
    it.go(0)
    it.delete(1)
    assert it.step(50).taken == 50
    with pytest.raises(SettingsError, match="there is no breakpoint 1"):
        it.delete(1)


def test_a_phase_breakpoint_stops_inside_every_step() -> None:
    it = plain_stepper()
    it.break_at("update")
    it.break_at("match")
    places = []
    for _ in range(5):
        it.step(10)
        assert it.paused is not None
        places.append((it.at, it.paused.phase.value))
    assert places == [(0, "update"), (0, "match"), (1, "update"), (1, "match"), (2, "update")]


def test_a_watch_shows_the_value_in_the_mind_and_stops_at_changes() -> None:
    it = reasoning_stepper(LONG)
    gap, apart = it.watch("gap(1, 2)"), it.watch("diverging(1, 3)", breaks=True)
    changed = []
    while not (stopped := it.step(LONG)).ended:
        assert stopped.step is not None
        changed.append(stopped.step.frame_index)
        here = it.mind.relation("diverging", 1, 3)
        assert here is not None
        assert {r.truth for r in apart.readings} == {here.truth}
    assert changed
    value = next(r.interval for r in gap.readings)
    touching = it.mind.relation("touching", 1, 2)
    assert touching is not None
    assert value == (touching.value, touching.value)
    it.go(3)
    assert gap.readings == ()  # nobody is confirmed there yet
    it.unwatch(gap.id)
    with pytest.raises(SettingsError, match="there is no watch 1"):
        it.unwatch(gap.id)


BAD = {
    "captur": "did you mean 'captured'",
    "rule colision_course": "did you mean 'collision_course'",
    "stage nowhere": "one of approach, captured",
    "phase think": "there is no phase",
    "gap(1, 2)) > 3": "does not belong here",
    "when gap(1, 2) < 3 s": "a length is compared with a time",
    "when foo(1)": "foo",
    "when gap(1,": "ends too early",
    "object one": "is not a number",
    "frame x": "is not a number",
    "two words": "is not known",
}


@pytest.mark.parametrize(("text", "said"), BAD.items())
def test_invalid_conditions_are_refused_with_a_message(text: str, said: str) -> None:
    mind = reasoning_course()[-1].mind
    with pytest.raises((SettingsError, RuleError, VisupError)) as fault:
        parse_condition(text, mind)
    assert said in str(fault.value)


@pytest.mark.parametrize("text", [*SCANS, "change gap(1, 2)"])
def test_the_text_of_a_condition_can_be_parsed_again(text: str) -> None:
    mind = reasoning_course()[-1].mind
    stop = parse_condition(text, mind)
    assert parse_condition(stop.text, mind).text == stop.text

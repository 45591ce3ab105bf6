"""One voice: what is told together agrees, on shared missions with percepts often wrong, and on worlds."""

from __future__ import annotations

import pytest

from tests.paths import SHARED
from tests.story.voice import (
    Told,
    a_name_changes_only_with_a_word,
    a_stage_fails_as_its_task_does,
    breaches,
    nothing_is_told_twice_at_once,
    prospects_agree_with_the_verdict,
    times_that_are_told_exclude_each_other_rightly,
    what_is_done_is_not_failing,
    who_has_left_does_nothing,
)
from tests.story.watched import told_of_mission, told_of_world
from visup.agent import Event, Mind, Observation, Severity, TaskBelief, Verdict
from visup.agent.model.step import Step
from visup.agent.model.task_beliefs import Prospect, StageBelief, Status
from visup.evaluation.simulation.percepts import PerceptNoise

MISSIONS, WORLDS = SHARED / "missions", SHARED / "worlds"
EVERY = 6
NOISE = PerceptNoise(seed=47, wrong=0.35)
"""Names are a little more often wrong than `visup eval reasoning` has them."""


@pytest.mark.skipif(not MISSIONS.is_dir(), reason="the shared missions are not beside the repo")
@pytest.mark.parametrize("name", [p.name for p in sorted(MISSIONS.glob("*")) if p.is_dir()])
def test_what_is_told_of_a_mission_agrees_with_itself(name: str) -> None:
    told = told_of_mission(MISSIONS / name, NOISE, EVERY)
    assert any(line.kind == "stage_started" for line in told.lines)
    assert breaches(told) == []


@pytest.mark.skipif(not WORLDS.is_dir(), reason="the shared worlds are not beside the repo")
@pytest.mark.parametrize("name", ["pick_ok", "drone_touch"])
def test_what_is_told_of_a_world_agrees_with_itself(name: str) -> None:
    """Two of them; `python -m tests.story` looks at all, and at clips of machines."""
    told = told_of_world(WORLDS / name, every=2)
    assert any(line.kind == "stage_started" for line in told.lines)
    assert breaches(told) == []


def line(text: str, time: float = 5.0, kind: str = "relation", *ids: int, **data: object) -> Event:
    return Event(kind, time, round(25 * time), text, ids, severity=Severity.INFO, data=data)


def believed(task: TaskBelief) -> Told:
    mind = Mind(time=5.0, tasks=(task,))
    return Told([], [Step(0, 5.0, Observation(0, 5.0, (64, 48)), mind, ())])


CAPTURED = {"task": "dock", "stage": "captured"}
FAILED = (StageBelief("captured", Status.FAILED, 1.0),)
BROKEN = [
    (
        a_name_changes_only_with_a_word,
        Told(
            [
                line("Object 4, believed to be the airplane, is in view."),
                line("Object 4, believed to be the hammer, is hidden."),
            ],
            [],
        ),
    ),
    (
        times_that_are_told_exclude_each_other_rightly,
        Told(
            [
                line("Stage `a` is complete: the arm and the satellite were converging until 12.7 s.", 12.7),
                line("Stage `b` has begun: the arm and the satellite have been touching since 10.6 s.", 12.7),
            ],
            [],
        ),
    ),
    (
        times_that_are_told_exclude_each_other_rightly,
        Told([line("Stage `a` goes well: the arm has been moving since 7.0 s.", 5.0)], []),
    ),
    (
        times_that_are_told_exclude_each_other_rightly,
        Told(
            [
                line("Stage `a` is complete: the arm and the part were touching from 3.0 s to 3.4 s.", 4.0),
                line("Stage `b` has begun: the arm and the part have been converging since 3.2 s.", 4.0),
            ],
            [],
        ),
    ),
    (
        times_that_are_told_exclude_each_other_rightly,
        Told(
            [
                line("Done: at 8.3 s the arm and the part had been coupled since 3.8 s.", 8.5),
                line("Begun: the arm and the part have been diverging since 8.1 s.", 8.5),
            ],
            [],
        ),
    ),
    (nothing_is_told_twice_at_once, Told([line("It is so.", 5.0), line("It is so.", 5.5)], [])),
    (
        what_is_done_is_not_failing,
        Told(
            [line("Done.", 5.0, "stage_done", **CAPTURED), line("Bad.", 6.0, "stage_failing", **CAPTURED)],
            [],
        ),
    ),
    (
        who_has_left_does_nothing,
        Told([line("It leaves.", 5.0, "exit", 3), line("They meet.", 6.0, "relation", 2, 3)], []),
    ),
    (
        prospects_agree_with_the_verdict,
        believed(TaskBelief("dock", Verdict.FAILED, success=0.27)),
    ),
    (
        prospects_agree_with_the_verdict,
        believed(TaskBelief("dock", Verdict.IN_PROGRESS, prospects=(Prospect("a", 0.7), Prospect("b", 0.4)))),
    ),
    (
        prospects_agree_with_the_verdict,
        believed(
            TaskBelief("dock", Verdict.IN_PROGRESS, prospects=(Prospect("captured", 0.07),), success=0.27)
        ),
    ),
    (
        prospects_agree_with_the_verdict,
        believed(TaskBelief("dock", Verdict.IN_PROGRESS, prospects=(Prospect("", 0.93),), success=0.27)),
    ),
    (a_stage_fails_as_its_task_does, believed(TaskBelief("dock", Verdict.SUCCEEDED, FAILED))),
]  # fmt: skip


@pytest.mark.parametrize(("law", "told"), BROKEN)
def test_each_law_finds_what_breaks_it(law: object, told: Told) -> None:
    found = breaches(told)
    assert found
    assert {x.partition(":")[0] for x in found} == {law.__name__}  # type: ignore[attr-defined]


def test_what_agrees_breaks_no_law() -> None:
    approach = {"task": "dock", "stage": "approach"}
    lines = [
        line("Object 4, believed to be the airplane, is in view."),
        line("Object 4, taken for the airplane, is the hammer.", 6.0, "identified", 4),
        line("Object 4, believed to be the hammer, is hidden.", 7.0),
        line("Done: the arm was converging until 10.6 s.", 12.7, "stage_done", **approach),
        line("Begun: the arm has been touching since 10.6 s.", 12.8, "stage_started", **approach),
        line("Bad: the arm has been diverging since 12.8 s.", 14.0, "stage_failing", **approach),
        line("It leaves.", 15.0, "exit", 3),
        line("It comes back.", 16.0, "entry", 3),
        line("They meet.", 17.0, "relation", 2, 3),
    ]
    assert breaches(Told(lines, [])) == []

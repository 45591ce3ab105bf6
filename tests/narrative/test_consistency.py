"""Narratives are consistent, of missions with percepts that are often wrong and of rendered worlds."""

from __future__ import annotations

import pytest

from tests.narrative.consistency import (
    NarratedRun,
    complete_stages_do_not_fail,
    exclusive_relations_do_not_overlap,
    failed_stages_match_the_verdict,
    name_changes_are_announced,
    no_sentence_repeats,
    objects_out_of_view_are_not_mentioned,
    prospects_match_the_verdict,
    violations,
)
from tests.narrative.narrated_runs import narrate_mission, narrate_world
from tests.paths import SHARED
from visup.agent import Event, Mind, Observation, Severity, TaskBelief, Verdict
from visup.agent.model.step import Step
from visup.agent.model.task_beliefs import Prospect, StageBelief, Status
from visup.evaluation.simulation.percepts import PerceptNoise

MISSIONS, WORLDS = SHARED / "missions", SHARED / "worlds"
EVERY = 6
NOISE = PerceptNoise(seed=47, wrong=0.35)
"""Names are wrong a little more often than in `visup eval reasoning`."""


@pytest.mark.skipif(not MISSIONS.is_dir(), reason="the shared missions are not beside the repo")
@pytest.mark.parametrize("name", [p.name for p in sorted(MISSIONS.glob("*")) if p.is_dir()])
def test_missions_are_narrated_consistently(name: str) -> None:
    narrated = narrate_mission(MISSIONS / name, NOISE, EVERY)
    assert any(line.kind == "stage_started" for line in narrated.lines)
    assert violations(narrated) == []


@pytest.mark.skipif(not WORLDS.is_dir(), reason="the shared worlds are not beside the repo")
@pytest.mark.parametrize("name", ["pick_ok", "drone_touch"])
def test_worlds_are_narrated_consistently(name: str) -> None:
    """Two of them; `python -m tests.narrative` checks all, and the clips of machines."""
    narrated = narrate_world(WORLDS / name, every=2)
    assert any(line.kind == "stage_started" for line in narrated.lines)
    assert violations(narrated) == []


def line(text: str, time: float = 5.0, kind: str = "relation", *ids: int, **data: object) -> Event:
    return Event(kind, time, round(25 * time), text, ids, severity=Severity.INFO, data=data)


def run_with_task(task: TaskBelief) -> NarratedRun:
    mind = Mind(time=5.0, tasks=(task,))
    return NarratedRun([], [Step(0, 5.0, Observation(0, 5.0, (64, 48)), mind, ())])


CAPTURED = {"task": "dock", "stage": "captured"}
FAILED = (StageBelief("captured", Status.FAILED, 1.0),)
INCONSISTENT = [
    (
        name_changes_are_announced,
        NarratedRun(
            [
                line("Object 4, believed to be the airplane, is in view."),
                line("Object 4, believed to be the hammer, is hidden."),
            ],
            [],
        ),
    ),
    (
        exclusive_relations_do_not_overlap,
        NarratedRun(
            [
                line("Stage `a` is complete: the arm and the satellite were converging until 12.7 s.", 12.7),
                line("Stage `b` has begun: the arm and the satellite have been touching since 10.6 s.", 12.7),
            ],
            [],
        ),
    ),
    (
        exclusive_relations_do_not_overlap,
        NarratedRun([line("Stage `a` goes well: the arm has been moving since 7.0 s.", 5.0)], []),
    ),
    (
        exclusive_relations_do_not_overlap,
        NarratedRun(
            [
                line("Stage `a` is complete: the arm and the part were touching from 3.0 s to 3.4 s.", 4.0),
                line("Stage `b` has begun: the arm and the part have been converging since 3.2 s.", 4.0),
            ],
            [],
        ),
    ),
    (
        exclusive_relations_do_not_overlap,
        NarratedRun(
            [
                line("Done: at 8.3 s the arm and the part had been coupled since 3.8 s.", 8.5),
                line("Begun: the arm and the part have been diverging since 8.1 s.", 8.5),
            ],
            [],
        ),
    ),
    (no_sentence_repeats, NarratedRun([line("It is so.", 5.0), line("It is so.", 5.5)], [])),
    (
        complete_stages_do_not_fail,
        NarratedRun(
            [line("Done.", 5.0, "stage_done", **CAPTURED), line("Bad.", 6.0, "stage_failing", **CAPTURED)],
            [],
        ),
    ),
    (
        objects_out_of_view_are_not_mentioned,
        NarratedRun([line("It leaves.", 5.0, "exit", 3), line("They meet.", 6.0, "relation", 2, 3)], []),
    ),
    (
        prospects_match_the_verdict,
        run_with_task(TaskBelief("dock", Verdict.FAILED, success=0.27)),
    ),
    (
        prospects_match_the_verdict,
        run_with_task(
            TaskBelief("dock", Verdict.IN_PROGRESS, prospects=(Prospect("a", 0.7), Prospect("b", 0.4)))
        ),
    ),
    (
        prospects_match_the_verdict,
        run_with_task(
            TaskBelief("dock", Verdict.IN_PROGRESS, prospects=(Prospect("captured", 0.07),), success=0.27)
        ),
    ),
    (
        prospects_match_the_verdict,
        run_with_task(TaskBelief("dock", Verdict.IN_PROGRESS, prospects=(Prospect("", 0.93),), success=0.27)),
    ),
    (failed_stages_match_the_verdict, run_with_task(TaskBelief("dock", Verdict.SUCCEEDED, FAILED))),
]  # fmt: skip


@pytest.mark.parametrize(("check", "narrated"), INCONSISTENT)
def test_each_check_finds_its_violation(check: object, narrated: NarratedRun) -> None:
    found = violations(narrated)
    assert found
    assert {x.partition(":")[0] for x in found} == {check.__name__}  # type: ignore[attr-defined]


def test_a_consistent_narrative_passes_all_checks() -> None:
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
    assert violations(NarratedRun(lines, [])) == []

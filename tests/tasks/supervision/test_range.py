"""To stay within a range: it lasts, begins inside, fails outside; what is not seen breaks nothing."""

from __future__ import annotations

from collections.abc import Callable
from math import nan, sin

import pytest

from tests.tasks.scripted import RelationSpan, Script, ScriptedRun, play
from visup.agent import Status, Verdict
from visup.tasks import parse_task
from visup.tasks.supervision.supervise import finish, task_reasoner

TASK = """<keep> ::= <near> <stay>
<near> ::= converging(arm, satellite)
<stay> ::= gap(arm, satellite) between 20 px and 100 px for 10 s"""
ALONE = TASK.splitlines()[2]
NEAR = (RelationSpan("converging", 0.0, 4.0), RelationSpan("diverging", 8.0, 30.0))


def watch_gaps(
    gaps: Callable[[float], float], task: str = TASK, until: float = 25.0
) -> ScriptedRun:
    return play(task_reasoner([parse_task(task)]), Script(NEAR, gaps=gaps), until, fps=5.0)


@pytest.mark.parametrize(
    ("task", "gaps", "verdict"),
    [
        (TASK, lambda t: max(60.0, 180 - 30 * t) + 30 * max(0.0, t - 8), Verdict.FAILED),
        (ALONE, lambda t: 60.0 + 15 * sin(2 * t), Verdict.SUCCEEDED),
        (ALONE, lambda t: 60.0 + 30 * max(0.0, t - 8), Verdict.FAILED),
        (ALONE, lambda t: 60.0 - 10 * max(0.0, t - 5), Verdict.FAILED),
        (ALONE, lambda t: 60.0 if t < 6 else nan, Verdict.IN_PROGRESS),
        (ALONE, lambda t: 60.0 if not 5 < t < 5.3 else 101.0, Verdict.SUCCEEDED),
    ],
)
def test_staying_in_a_range_succeeds_and_leaving_it_fails(
    task: str, gaps: Callable[[float], float], verdict: Verdict
) -> None:
    assert finish(watch_gaps(gaps, task).last.tasks[0]) is verdict


WITHIN = "<stay> ::= gap(arm, satellite) < 100 px for 10 s"
FAR = "<away> ::= gap(arm, satellite) > 100 px for 10 s"


@pytest.mark.parametrize(
    ("task", "gaps", "failing_at"),
    [
        (
            WITHIN,
            lambda t: 60.0 + 30 * max(0.0, t - 6.0),
            8.6,
        ),  # beyond it from 7.3 s, drawing apart from 8 s
        (WITHIN, lambda t: 60.0 + 30 * max(0.0, t - 9.0), 10.9),  # drawing apart before, within it
        (WITHIN, lambda t: 60.0 + 3 * max(0.0, t - 8.0), None),  # it is near for long enough
        (WITHIN, lambda t: 60.0 if not 8.2 < t < 8.5 else 101.0, None),
        (WITHIN, lambda t: 60.0 if t < 9.0 else nan, None),  # what is not seen breaks nothing
        (FAR, lambda t: 200.0, None),
        (FAR, lambda t: 200.0 - 120 * max(0.0, min(t - 1.0, 2.0)), 2.5),
    ],
)
def test_who_leaves_a_range_before_the_time_fails(
    task: str, gaps: Callable[[float], float], failing_at: float | None
) -> None:
    played = watch_gaps(gaps, task, 14.0)
    failing = [e.time for e in played.events if e.kind == "stage_failing"]
    assert failing == ([] if failing_at is None else [pytest.approx(failing_at, abs=0.3)])


def test_oscillation_within_the_range_is_accepted() -> None:
    played = play(
        task_reasoner([parse_task(TASK)]),
        Script(NEAR[:1], gaps=lambda t: max(60.0, 180 - 30 * t) + 15 * sin(2 * t)),
        25.0,
        fps=5.0,
    )
    assert finish(played.last.tasks[0]) is Verdict.SUCCEEDED


def test_coming_nearer_within_a_range_is_expected() -> None:
    (task,) = watch_gaps(lambda t: 60.0 + 15 * sin(2 * t), ALONE, 5.0).last.tasks
    assert "converging" in {e.relation for e in task.expected}


def test_a_range_begins_when_the_gap_comes_into_it() -> None:
    played = watch_gaps(lambda t: max(60.0, 180 - 30 * t))
    begun = next(e for e in played.events if e.data.get("stage") == "stay")
    assert begun.time == pytest.approx(80 / 30, abs=0.7)


def test_a_comparison_in_an_end_condition_is_evaluated() -> None:
    task = "<near> ::= converging(arm, satellite) ends when gap(arm, satellite) < 90 px"
    played = watch_gaps(lambda t: 180 - 30 * min(t, 4.0), task, 8.0)
    (stage,) = played.last.tasks[0].stages
    assert stage.status is Status.DONE
    assert finish(played.last.tasks[0]) is Verdict.SUCCEEDED

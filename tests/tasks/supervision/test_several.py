"""Several tasks: which of them is active; the others are not reported."""

from __future__ import annotations

from itertools import pairwise

import pytest

from tests.tasks.scripted import RelationSpan, Script, ScriptedRun, play
from visup.agent import Status, TaskBelief, Verdict
from visup.runs.wiring import final_verdict
from visup.tasks import parse_task
from visup.tasks.supervision.supervise import UNREPORTED_S, task_reasoner
from visup.tasks.supervision.task_inference import REPORTABLE

DOCK = parse_task("""<dock> ::= <approach> <captured>
<approach> ::= converging(arm, satellite)
<captured> ::= coupled(arm, satellite)
""")
INSPECT = parse_task("""<inspect> ::= <near> <look>
<near> ::= converging(arm, satellite)
<look> ::= keeping_distance(arm, satellite) for 3 s fails when touching(arm, satellite)
""")
LEAVE = parse_task("""<leave> ::= <away> <clear>
<away> ::= diverging(arm, satellite)
<clear> ::= keeping_distance(arm, satellite) for 2 s
""")
DOCKS = (
    RelationSpan("converging", 0.5, 12.3),
    RelationSpan("touching", 12.0, 30),
    RelationSpan("moving_together", 12.6, 30),
    RelationSpan("coupled", 13.0, 30),
)
FAILS = (
    RelationSpan("converging", 0.5, 12.3),
    RelationSpan("touching", 12.0, 12.8),
    RelationSpan("diverging", 12.8, 30),
)
INSPECTS = (RelationSpan("converging", 0.5, 10.0), RelationSpan("keeping_distance", 10.2, 30))
PARTS = (
    RelationSpan("touching", 0.0, 8.0),
    RelationSpan("moving_together", 0.0, 8.0),
    RelationSpan("coupled", 0.0, 8.0),
    RelationSpan("diverging", 8.2, 16),
    RelationSpan("keeping_distance", 16.2, 18.8),
)


def watch(spans: tuple[RelationSpan, ...], until: float = 26.0) -> ScriptedRun:
    return play(task_reasoner([DOCK, INSPECT, LEAVE]), Script(spans), until)


def belief(played: ScriptedRun, task: str, time: float | None = None) -> TaskBelief:
    mind = played.last if time is None else played.at(time)
    return next(t for t in mind.tasks if t.task == task)


@pytest.mark.parametrize(
    ("spans", "task", "verdict"),
    [
        (DOCKS, "dock", Verdict.SUCCEEDED),
        (FAILS, "dock", Verdict.FAILED),
        (INSPECTS, "inspect", Verdict.SUCCEEDED),
        (PARTS, "leave", Verdict.SUCCEEDED),
    ],
)
def test_the_active_task_determines_the_verdict(
    spans: tuple[RelationSpan, ...], task: str, verdict: Verdict
) -> None:
    played = watch(spans)
    assert final_verdict(played.last) is verdict
    ends = {(e.data["task"], e.data["verdict"]) for e in played.events if e.kind == "verdict"}
    assert ends == {(task, str(verdict))}


def test_tasks_with_the_same_beginning_are_equally_likely_until_they_differ() -> None:
    played = watch(DOCKS)
    early = {t.task: t.active for t in played.at(8.0).tasks}
    assert early["dock"] == pytest.approx(early["inspect"], abs=0.02)
    assert early["dock"] > 0.4
    assert early["leave"] < 0.05
    assert belief(played, "inspect").active < REPORTABLE


def test_an_inactive_task_is_not_reported_as_failing() -> None:
    for spans in (DOCKS, INSPECTS, PARTS):
        played = watch(spans)
        failing = [e.text for e in played.events if e.kind in ("stage_failing", "stage_failed")]
        assert failing == []
        assert not any(o.conditions for o in played.outcomes)


def test_a_reported_failure_is_not_revised_when_another_task_begins() -> None:
    played = watch(FAILS)
    assert belief(played, "leave").active > 0.9
    assert belief(played, "dock").verdict is Verdict.FAILED
    reported = [e.data["stage"] for e in played.events if e.kind == "stage_failing"]
    assert reported == ["captured"]


def test_before_any_observation_no_task_is_reported() -> None:
    played = watch((), 10.0)
    assert {t.verdict for t in played.last.tasks} == {Verdict.UNKNOWN}
    assert {s.status for t in played.last.tasks for s in t.stages} == {Status.PENDING}
    assert played.events == ()


def test_only_relations_of_likely_tasks_are_expected() -> None:
    played = watch(DOCKS)
    expected = {e.relation for t in played.at(8.0).tasks for e in t.expected}
    assert "converging" in expected
    assert "diverging" not in expected


def test_recognition_and_rejection_of_a_task_are_reported() -> None:
    played = watch(DOCKS)
    reported = [(e.kind, e.data["task"]) for e in played.events if e.kind.startswith("task_")]
    assert ("task_active", "dock") in reported
    assert ("task_inactive", "inspect") in reported
    assert reported.index(("task_active", "inspect")) < reported.index(("task_inactive", "inspect"))


def test_reportable_tasks_are_updated_in_each_step_and_others_less_often() -> None:
    minds = play(task_reasoner([DOCK, INSPECT, LEAVE]), Script(DOCKS), 26.0, 25.0).minds
    paces = set()
    for before, mind in pairwise(minds):
        for old, new in zip(before.memory["tasks"], mind.memory["tasks"], strict=True):
            if old.activity.reportable:
                assert new.time == mind.time
            else:
                assert mind.time - new.time < UNREPORTED_S
                paces |= {round(new.time - old.time, 6)} - {0.0}
    assert paces == {UNREPORTED_S}


def test_a_single_task_is_updated_in_each_step() -> None:
    for mind in play(task_reasoner([DOCK]), Script(DOCKS), 15.0, 25.0).minds:
        assert mind.memory["tasks"][0].time == mind.time

"""The missions of the paper's kind, from percepts made of their truth, through rules to verdicts."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from types import MappingProxyType

import pytest

from tests.rules.percepts_from_truth import MISSIONS, Noise, actors_of, observations, truth_of
from visup.agent import Alert, AlertCondition, Event, Mind, Severity, Status, TaskBelief, Verdict
from visup.rules.reasoners import default_reasoners
from visup.tasks import load_task
from visup.tasks.supervision.supervise import finish, task_reasoner

NAMES = (
    "approach_aborted",
    "capture_fails",
    "capture_fails_over_earth",
    "capture_succeeds",
    "intruder_on_collision_course",
    "occlusion_by_intruder",
)
pytestmark = pytest.mark.skipif(
    not (MISSIONS / NAMES[0]).exists(), reason="the shared missions are not beside the repo"
)


@dataclass(frozen=True)
class Run:
    beliefs: tuple[tuple[float, TaskBelief], ...]
    events: tuple[Event, ...]
    alerts: tuple[AlertCondition, ...]
    minds: tuple[Mind, ...]


@cache
def run(name: str) -> Run:
    """All reasoners on one mission, with alerts opened and closed as the act phase does."""
    shipped = default_reasoners()
    chain = (*shipped.update, *shipped.cogitate, task_reasoner([load_task("dock")]))
    mind = Mind(actors=MappingProxyType(actors_of(name)))
    beliefs: list[tuple[float, TaskBelief]] = []
    events: list[Event] = []
    alerts: list[AlertCondition] = []
    minds: list[Mind] = []
    for observation, _ in observations(name, Noise(every=3)):
        mind = replace(
            mind,
            time=observation.time,
            frame_index=observation.frame_index,
            frame_size=observation.frame_size,
        )
        conditions: list[AlertCondition] = []
        for reasoner in chain:
            outcome = reasoner(mind, observation)
            mind = outcome.mind
            events += outcome.events
            conditions += outcome.conditions
        open_now = {(a.kind, a.objects, a.key) for a in mind.alerts}
        alerts += [c for c in conditions if (c.kind, c.objects, c.key) not in open_now]
        mind = replace(mind, alerts=tuple(_alert(c, observation.time) for c in conditions))
        beliefs.append((observation.time, mind.tasks[0]))
        minds.append(mind)
    return Run(tuple(beliefs), tuple(events), tuple(alerts), tuple(minds))


def _alert(condition: AlertCondition, now: float) -> Alert:
    c = condition
    return Alert(1, c.kind, c.severity, now, now, c.objects, c.cause, key=c.key)


@pytest.mark.parametrize("name", NAMES)
def test_the_verdict_is_correct(name: str) -> None:
    assert finish(run(name).beliefs[-1][1]) is Verdict(truth_of(name)["verdict"])


@pytest.mark.parametrize("name", NAMES)
def test_stage_and_outcome_are_correct_in_most_frames(name: str) -> None:
    truth = truth_of(name)
    right = [
        _stage_and_outcome(belief) == expected
        for time, belief in run(name).beliefs
        if (expected := _true_stage_and_outcome(truth, time)) is not None
    ]
    # What the border cuts may be a part of something known: of a stranger that comes in it is told a
    # moment later, when it is whole.
    assert sum(right) >= 0.88 * len(right)


def _true_stage_and_outcome(
    truth: dict[str, list[dict[str, object]]], time: float
) -> tuple[str, str] | None:
    """The true stage and outcome so far, or None within a second of a change."""
    opened = [float(str(a["from_s"])) for a in truth["alerts"]]
    for stage in truth["stages"]:
        begins, ends = float(str(stage["from_s"])), float(str(stage["to_s"]))
        if not begins <= time < ends:
            continue
        if any(abs(time - t) <= 1.0 for t in (begins, ends, *opened)):
            return None
        bad = stage["outcome"] != "complete" and any(time >= t for t in opened)
        return str(stage["stage"]), str(stage["outcome"]) if bad else "progressing"
    return None


def _stage_and_outcome(belief: TaskBelief) -> tuple[str, str]:
    stage = belief.current or belief.stages[-1].stage
    status = next(s.status for s in belief.stages if s.stage == stage)
    if belief.verdict is Verdict.INTERRUPTED:
        return stage, "unsafe"
    return stage, "failing" if status in (Status.FAILING, Status.FAILED) else "progressing"


@pytest.mark.parametrize("name", NAMES)
def test_a_failing_stage_is_reported_soon(name: str) -> None:
    expected = [a["from_s"] for a in truth_of(name)["alerts"] if a["kind"] == "stage_failing"]
    reported = [e.time for e in run(name).events if e.kind == "stage_failing"]
    if expected:
        assert -0.5 <= reported[0] - expected[0] <= 2.0
    else:
        assert not [e for e in run(name).events if e.kind == "stage_failing" and e.severity]


@pytest.mark.parametrize("name", NAMES)
def test_there_are_no_false_alerts(name: str) -> None:
    expected = {a["kind"] for a in truth_of(name)["alerts"]}
    warned = {c.kind for c in run(name).alerts if c.severity >= Severity.WARNING}
    assert warned <= expected


def test_the_narrative_is_that_of_the_paper() -> None:
    reported = [
        e.text for e in run("capture_fails").events if e.kind.startswith(("stage", "verdict"))
    ]
    assert reported[0] == (
        "Stage `approach` of task `dock` has begun, with object 1, believed to be the arm, "
        "and object 2, believed to be the satellite."
    )
    assert reported[1].startswith("Stage `approach` is progressing satisfactorily: ")
    assert reported[2].startswith("Stage `approach` is complete")
    assert reported[3].startswith("Stage `captured` of task `dock` has begun")
    failing = next(t for t in reported if t.startswith("Stage `captured` is failing: "))
    assert failing.endswith("s; stage `captured` requires them to be coupled.")
    assert reported[-1].startswith("Task `dock` has failed: ")

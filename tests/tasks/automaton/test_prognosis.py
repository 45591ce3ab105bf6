"""What supervision reports beyond statuses: confidence, prospects, revisions."""

from __future__ import annotations

import math

import pytest

from tests.tasks.scripted import FPS, RelationSpan, Script, ScriptedRun, play
from visup.agent import TaskBelief, Verdict
from visup.tasks import load_task, parse_task
from visup.tasks.automaton.hidden_phases import hidden_filter
from visup.tasks.automaton.stage_hmm import SUPERVISION_HMM, ActionStatus
from visup.tasks.supervision.sentences import prospects_text
from visup.tasks.supervision.supervise import task_reasoner

FAILS = (
    RelationSpan("converging", 0.5, 12.3),
    RelationSpan("touching", 12.0, 12.8),
    RelationSpan("diverging", 12.8, 30),
)
SUCCEEDS = (
    RelationSpan("converging", 0.5, 12.3),
    RelationSpan("touching", 12.0, 30),
    RelationSpan("coupled", 13.0, 30),
)


def watch(
    *spans: RelationSpan, until: float = 26.0, text: str = "", fps: float = FPS
) -> ScriptedRun:
    task = parse_task(text) if text else load_task("dock")
    return play(task_reasoner([task]), Script(spans), until, fps)


def belief(played: ScriptedRun, time: float) -> TaskBelief:
    return played.at(time).tasks[0]


@pytest.mark.parametrize("spans", [FAILS, SUCCEEDS])
def test_hypotheses_sum_to_one_and_reported_beliefs_are_marginals(
    spans: tuple[RelationSpan, ...],
) -> None:
    played = watch(*spans)
    for mind in played.minds[3:]:
        weighted = mind.memory["tasks"][0].posterior.hypotheses.values()
        masses = [w.mass for w in weighted]
        assert math.isclose(sum(masses), 1.0)
        assert masses == sorted(masses, reverse=True)
        task = mind.tasks[0]
        if task.verdict is Verdict.IN_PROGRESS:
            masses_of_stage = [w.mass for w in weighted if task.current in w.value.under_way]
            assert task.confidence == pytest.approx(sum(masses_of_stage))
        elif task.verdict is Verdict.SUCCEEDED:
            done = [w.mass for w in weighted if w.value.finished is not None]
            assert task.confidence == pytest.approx(sum(done))


def test_confidence_does_not_depend_on_the_frame_rate() -> None:
    runs = [watch(*FAILS, until=15.0, fps=fps) for fps in (5.0, 10.0, 25.0)]
    for time in (8.0, 12.6, 15.0):
        confidences = [belief(run, time).confidence for run in runs]
        assert max(confidences) - min(confidences) < 0.1


def test_prospects_have_probabilities() -> None:
    played = watch(*SUCCEEDS)
    early = belief(played, 6.0)
    assert [p.stage for p in early.prospects] == ["captured"]
    assert early.prospects[0].probability > 0.8
    late = belief(played, 14.5).prospects
    assert late[0].stage == ""
    assert late[0].probability > 0.8
    retry = watch(
        *FAILS,
        text="<t> ::= <go> (<on> | <back> <t>)\n<go> ::= converging(arm, satellite)\n"
        "<on> ::= coupled(arm, satellite)\n<back> ::= diverging(arm, satellite)",
    )
    probabilities = {p.stage: p.probability for p in belief(retry, 0.8).prospects}
    assert probabilities == {"on": pytest.approx(0.5, abs=0.1), "back": pytest.approx(0.5, abs=0.1)}


def test_success_is_no_likelier_than_all_prospects_together() -> None:
    """What fails is not told to go to its end with 93 % and to end well with 27 % at once."""
    played = watch(*FAILS)
    for mind in played.minds[3:]:
        (task,) = mind.tasks
        coming = sum(p.probability for p in task.prospects)
        assert task.success is not None
        assert task.success <= coming + 0.02 <= 1.03
    failing = prospects_text(belief(played, 15.0))
    assert "failure (" in failing
    assert prospects_text(belief(played, 25.0)) == "next: nothing, the task is over"


def test_success_falls_with_a_failure_and_rises_towards_the_end() -> None:
    good, bad = watch(*SUCCEEDS), watch(*FAILS)

    def hope(played: ScriptedRun, time: float) -> float:
        success = belief(played, time).success
        assert success is not None
        return success

    assert hope(good, 20.0) > hope(good, 13.0) > hope(good, 5.0) > 0.6
    assert hope(good, 20.0) > 0.95
    assert hope(bad, 15.0) < hope(bad, 12.7) / 2
    assert belief(bad, 25.0).verdict is Verdict.FAILED
    assert hope(bad, 25.0) == 0.0


def test_a_stage_reported_done_is_revised_when_later_evidence_contradicts_it() -> None:
    played = watch(
        RelationSpan("converging", 0.5, 5.0),
        RelationSpan("touching", 4.8, 5.3),  # a glimpse of a touch, and the approach goes on
        RelationSpan("converging", 6.0, 60.0),
        until=50.0,
    )
    assert belief(played, 8.0).current == "captured"
    assert played.last.tasks[0].current == "approach"
    revisions = [e for e in played.events if e.kind == "stage_revised"]
    assert [e.data["stage"] for e in revisions] == ["approach"]
    assert "reported complete at 5." in revisions[0].text
    assert "is now believed still to be going on" in revisions[0].text
    assert not [e for e in watch(*SUCCEEDS).events if e.kind == "stage_revised"]


def test_uncertain_relations_count_for_less() -> None:
    for status in (ActionStatus.NEITHER, ActionStatus.CONTRARY):
        fits = [SUPERVISION_HMM.fit(status, confidence, 1.0) for confidence in (1.0, 0.7, 0.3, 0.0)]
        assert fits == sorted(fits)
        assert fits[-1] == pytest.approx(1.0)
    halves = SUPERVISION_HMM.fit(ActionStatus.CONTRARY, 0.8, 0.5) ** 2
    assert halves == pytest.approx(SUPERVISION_HMM.fit(ActionStatus.CONTRARY, 0.8, 1.0))


def test_prospects_are_one_line_of_text() -> None:
    played = watch(*SUCCEEDS)
    text = prospects_text(belief(played, 6.0))
    assert text.startswith("next: `captured` (")
    assert "ends well with a probability of 8" in text
    assert prospects_text(TaskBelief("t", Verdict.UNKNOWN)) == "next: unknown"


def test_absence_of_evidence_counts_less_than_contrary_evidence() -> None:
    fit = SUPERVISION_HMM.fit
    order = [
        fit(s, 1.0, 1.0)
        for s in (
            ActionStatus.CONTRARY,
            ActionStatus.NEITHER,
            ActionStatus.UNKNOWN,
            ActionStatus.HOLDS,
        )
    ]
    assert order == sorted(order)


def test_a_recursive_stage_inside_another_is_expanded_finitely() -> None:
    task = parse_task(
        "<t> ::= <loop>\n<loop> ::= converging(arm, satellite)"
        " | touching(arm, satellite) & (diverging(arm, satellite) <loop>)"
    )
    recogniser = hidden_filter(task)
    assert 0.0 < recogniser.success(recogniser.start()) < 1.0

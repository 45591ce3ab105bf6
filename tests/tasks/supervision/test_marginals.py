"""Reported beliefs are marginals: as likely as all hypotheses that agree with them."""

from __future__ import annotations

from dataclasses import replace

import pytest

from tests.tasks.scripted import RelationSpan, Script, ScriptedRun, play
from visup.agent import Status, TaskBelief, Verdict
from visup.tasks import parse_task
from visup.tasks.supervision.supervise import task_reasoner

PAIRS = ((1, 2), (1, 3), (2, 3), (1, 4))
EVERY_S = 3.0  # from one stage to the next


def any_order(count: int, action: str) -> str:
    """A task of so many stages in any order, each between another pair."""
    actors = "".join(f"actor {n} is m{i}\n" for i, n in enumerate("abcd"[: max(3, count)], 1))
    stages = [f"<s{i}> ::= {action}({_named(p)})" for i, p in enumerate(PAIRS[:count])]
    order = ", ".join(f"<s{i}>" for i in range(count))
    return f"{actors}<t> ::= any order ({order})\n" + "\n".join(stages)


def _named(pair: tuple[int, int]) -> str:
    return ", ".join("abcd"[i - 1] for i in pair)


def script(count: int, relation: str, lasts_s: float, of: tuple[int, ...]) -> Script:
    """Stages one after the other, in some order, each between its own pair."""
    spans = tuple(
        RelationSpan(relation, t, t + lasts_s, PAIRS[i])
        for t, i in zip((1.0 + EVERY_S * k for k in range(count)), of, strict=True)
    )
    number = max(3, count)
    return Script(
        spans,
        objects=dict.fromkeys(range(1, number + 1), (0.0, 1000000000.0)),
        identities={i: {f"m{i}": 0.9} for i in range(1, number + 1)},
    )


def followed(
    count: int, action: str, relation: str, lasts_s: float, of: tuple[int, ...]
) -> ScriptedRun:
    reasoner = task_reasoner([parse_task(any_order(count, action))])
    return play(reasoner, script(count, relation, lasts_s, of), 1.0 + EVERY_S * count + 4.0)


def belief(played: ScriptedRun, time: float) -> TaskBelief:
    return played.at(time).tasks[0]


@pytest.mark.parametrize("of", [(0, 1, 2), (2, 0, 1), (1, 3, 0, 2), (3, 2, 1, 0)])
@pytest.mark.parametrize(
    ("relation", "lasts_s"), [("touching", 2.0), ("touching", 99.0), ("coupled", 2.0)]
)
def test_done_stages_are_reported_in_any_order(
    of: tuple[int, ...], relation: str, lasts_s: float
) -> None:
    count = len(of)
    played = followed(count, relation, relation, lasts_s, of)
    for k, stage in enumerate(of, 1):
        stages = {s.stage: s for s in belief(played, EVERY_S * k + 0.5).stages}
        done, pending = stages[f"s{stage}"], [stages[f"s{i}"] for i in of[k:]]
        assert done.status is Status.DONE
        assert done.confidence > 0.75
        assert not [s for s in pending if s.status in (Status.DONE, Status.PROGRESSING)]
    last = played.last.tasks[0]
    assert last.verdict is Verdict.SUCCEEDED
    assert last.confidence > 0.84
    assert [s.status for s in last.stages] == [Status.DONE] * count


def test_the_confidence_in_a_done_stage_is_the_mass_of_all_orders() -> None:
    played = followed(3, "touching", "touching", 2.0, (0, 1, 2))
    for mind in played.minds[12:]:
        weighted = mind.memory["tasks"][0].posterior.hypotheses.values()
        for stage in mind.tasks[0].stages:
            if stage.status is Status.DONE:
                masses = [
                    w.mass
                    for w in weighted
                    if any(
                        p.stage == stage.stage and p.status is stage.status for p in w.value.past
                    )
                    or w.value.finished is not None
                ]
                assert stage.confidence == pytest.approx(sum(masses), abs=1e-6)


def test_without_observations_no_stage_is_reported_as_begun() -> None:
    quiet = replace(script(3, "touching", 2.0, (0, 1, 2)), spans=())
    played = play(task_reasoner([parse_task(any_order(3, "touching"))]), quiet, 3.0)
    task = played.last.tasks[0]
    assert {s.status for s in task.stages} == {Status.PENDING}
    assert task.verdict is Verdict.UNKNOWN
    assert task.confidence == pytest.approx(1 / 3)
    assert played.events == ()


def test_a_false_alarm_counts_once_however_long_it_lasts() -> None:
    """What is seen before its time speaks for a course that skipped what is missing, not without end."""
    text = (
        "<t> ::= <near> <still>\n<near> ::= converging(arm, satellite)\n"
        "<still> ::= keeping_distance(arm, satellite) for 2 s"
    )
    spans = (RelationSpan("keeping_distance", 0.0, 8.0), RelationSpan("converging", 8.0, 12.0))
    played = play(task_reasoner([parse_task(text)]), Script(spans), 11.0)
    assert belief(played, 7.5).current == "near"
    assert belief(played, 11.0).current == "near"


def test_evidence_against_two_actions_of_a_stage_counts_once() -> None:
    """A tug that leaves without its cart fails to haul it: it has not failed to approach it."""
    text = (
        "<fetch> ::= <approach> <meet> <haul>\n<approach> ::= converging(arm, satellite)\n"
        "<meet> ::= touching(arm, satellite)\n<haul> ::= moving_together(arm, satellite) "
        "& keeping_distance(arm, satellite) fails when diverging(arm, satellite)"
    )
    spans = (
        RelationSpan("converging", 0.0, 5.6),
        RelationSpan("touching", 4.5, 7.0),
        RelationSpan("diverging", 7.0, 14.0),
    )
    played = play(task_reasoner([parse_task(text)]), Script(spans), 12.0)
    assert belief(played, 6.5).current == "haul"
    status = {s.stage: s.status for s in belief(played, 7.8).stages}
    assert status == {"approach": Status.DONE, "meet": Status.DONE, "haul": Status.FAILING}
    later = {s.stage: s.status for s in belief(played, 12.0).stages}
    assert later == status

"""Judging back in time: an actor that is named late is taken to have been there all along."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.tasks.scripted import ARM, IDENTITIES, SATELLITE, RelationSpan, Script, mind_at
from visup.agent import Mind, Observation, Status, TaskBelief, Verdict
from visup.tasks import parse_task
from visup.tasks.supervision.replay import EVERY_S, MEMORY_S
from visup.tasks.supervision.supervise import MEMORY, finish, task_reasoner

DOCK = """<dock> ::= <approach> <captured> <leave>
<approach> ::= converging(arm, satellite)
<captured> ::= coupled(arm, satellite)
<leave> ::= diverging(arm, satellite) for 1 s"""
GOOD = (
    RelationSpan("converging", 1.0, 4.0),
    RelationSpan("touching", 4.0, 12.0),
    RelationSpan("coupled", 5.0, 12.0),
    RelationSpan("diverging", 12.0, 16.0),
)
# It was never coupled: the arm came, touched, and went.
MISSED = (
    RelationSpan("converging", 1.0, 4.0),
    RelationSpan("touching", 4.0, 5.0),
    RelationSpan("diverging", 5.0, 16.0),
)
NOBODY: Mapping[int, Mapping[str, float]] = {}


def final_mind(
    identified_at: Mapping[int, float], spans: tuple[RelationSpan, ...], until: float = 16.0
) -> Mind:
    """What is believed in the end where objects are named at some times."""
    reasoner, mind = task_reasoner([parse_task(DOCK)]), Mind()
    for index in range(round(until * 10) + 1):
        now = index / 10
        identified = {i: IDENTITIES[i] for i, t in identified_at.items() if now >= t}
        mind = mind_at(Script(spans, identities=identified), now, index, mind)
        mind = reasoner(mind, Observation(index, now, (640, 480))).mind
    return mind


def final_belief(identified_at: Mapping[int, float], spans: tuple[RelationSpan, ...]) -> TaskBelief:
    return final_mind(identified_at, spans).tasks[0]


def statuses(belief: TaskBelief) -> list[Status]:
    return [s.status for s in belief.stages]


@pytest.mark.parametrize("late", [2.0, 4.5, 7.0, 11.0])
def test_a_late_identification_gives_the_verdict_of_an_early_one(late: float) -> None:
    early = final_belief({ARM: 0.0, SATELLITE: 0.0}, GOOD)
    assert early.verdict is Verdict.SUCCEEDED
    for named in (
        {ARM: 0.0, SATELLITE: late},
        {ARM: late, SATELLITE: 0.0},
        {ARM: late, SATELLITE: 3.0},
    ):
        assert final_belief(named, GOOD).verdict is Verdict.SUCCEEDED
        assert statuses(final_belief(named, GOOD)) == [Status.DONE] * 3


def test_a_failure_before_the_identification_is_found() -> None:
    early = finish(final_belief({ARM: 0.0, SATELLITE: 0.0}, MISSED))
    assert early is Verdict.FAILED
    assert finish(final_belief({ARM: 0.0, SATELLITE: 7.0}, MISSED)) is early


@settings(max_examples=8, deadline=None)
@given(st.floats(0.5, 11.0))
def test_a_late_identification_gives_the_hypotheses_of_an_early_one(late: float) -> None:
    early, other = (
        final_mind({ARM: 0.0, SATELLITE: t}, GOOD, 14.0).recall(MEMORY)[0].posterior
        for t in (0.0, late)
    )
    assert early is not None
    assert other is not None
    assert early.best == other.best
    assert early.likeliest.past[0].stage == other.likeliest.past[0].stage == "approach"


def test_stored_observations_are_limited_and_released() -> None:
    waiting = final_mind({ARM: 0.0}, GOOD, 70.0).recall(MEMORY)[0]
    assert len(waiting.past_steps) <= MEMORY_S / EVERY_S + 2
    assert all(not look.mind.tasks for look in waiting.past_steps)
    assert all("tasks" not in look.mind.memory for look in waiting.past_steps)
    assert final_mind({ARM: 0.0, SATELLITE: 3.0}, GOOD, 5.0).recall(MEMORY)[0].past_steps == ()


def test_an_object_that_comes_late_has_no_past() -> None:
    """The task does not begin before there is somebody to act."""
    script = Script(GOOD, objects={ARM: (0.0, 1e9), SATELLITE: (7.0, 1e9)})
    reasoner, mind = task_reasoner([parse_task(DOCK)]), Mind()
    for index in range(91):
        mind = mind_at(script, index / 10, index, mind)
        mind = reasoner(mind, Observation(index, index / 10, (640, 480))).mind
    assert statuses(replace(mind).tasks[0])[0] is not Status.DONE

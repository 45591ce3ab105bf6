"""`after 5 s to 10 s`: a stage begins so long after what comes before it, no sooner and no later."""

from __future__ import annotations

import pytest

from tests.tasks.scripted import RelationSpan, Script, ScriptedRun, play, task_of
from visup.agent import Verdict
from visup.tasks import parse_task
from visup.tasks.supervision.supervise import finish, task_reasoner

CAR, HOSE, SPONGE = 1, 2, 3
NAMES = {CAR: {"car": 0.9}, HOSE: {"hose": 0.9}, SPONGE: {"sponge": 0.9}}
WASH = """<wash>  ::= <soap> <rinse>
<soap>  ::= touching(hose, car) for 2 s
<rinse> ::= touching(sponge, car) {}
"""
OVER_S = 3.0
"""When `<soap>` is over: the hose touches the car from 1 s on."""


def washed(clause: str, begins: float, text: str = WASH) -> ScriptedRun:
    """The sponge is on the car for 4 s."""
    spans = (
        RelationSpan("touching", 1.0, OVER_S, (CAR, HOSE)),
        RelationSpan("touching", begins, begins + 4.0, (CAR, SPONGE)),
    )
    script = Script(spans, objects=dict.fromkeys(NAMES, (0.0, 1e9)), identities=NAMES)
    reasoner = task_reasoner([parse_task(text.format(clause))])
    return play(reasoner, script, max(20.0, begins + 6.0), fps=5.0)


@pytest.mark.parametrize("begins", [3.6, 5.0, 7.0, 9.0, 12.0, 14.0, 17.0])
@pytest.mark.parametrize(
    ("clause", "min_s", "max_s"),
    [
        ("", 0.0, 1e9),
        ("after 5 s", 5.0, 1e9),
        ("after 0 s to 5 s", 0.0, 5.0),
        ("after 5 s to 10 s", 5.0, 10.0),
    ],
)
def test_a_stage_begins_neither_sooner_nor_later_than_its_delay(
    clause: str, min_s: float, max_s: float, begins: float
) -> None:
    verdict = finish(task_of(washed(clause, begins)))
    assert (verdict is Verdict.SUCCEEDED) == (min_s <= begins - OVER_S <= max_s)


@pytest.mark.parametrize(("begins", "good"), [(3.0, False), (7.0, True), (13.0, False)])
def test_a_delay_of_the_first_stage_counts_from_the_beginning(begins: float, good: bool) -> None:
    text = "<wash> ::= touching(hose, car) for 2 s {}"
    script = Script(
        (RelationSpan("touching", begins, 1e9, (CAR, HOSE)),),
        objects=dict.fromkeys(NAMES, (0.0, 1e9)),
        identities=NAMES,
    )
    reasoner = task_reasoner([parse_task(text.format("after 5 s to 10 s"))])
    played = play(reasoner, script, 20.0, fps=5.0)
    assert (finish(task_of(played)) is Verdict.SUCCEEDED) == good


@pytest.mark.parametrize(
    ("begins", "reason"),
    [
        (
            5.0,
            "s after the stage before it, but should begin no sooner than 5 s",
        ),
        (17.0, "`rinse` should begin no later than 10 s after the stage before it, but did not"),
    ],
)
def test_the_reason_of_a_failure_is_reported(begins: float, reason: str) -> None:
    assert any(reason in e.text for e in washed("after 5 s to 10 s", begins).events)


def test_a_delay_after_a_lasting_action_counts_from_its_last_observation() -> None:
    text = WASH.replace("touching(hose, car) for 2 s", "converging(hose, car)")
    for begins, good in ((6.0, False), (10.0, True)):
        spans = (
            RelationSpan("converging", 1.0, OVER_S, (CAR, HOSE)),
            RelationSpan("touching", begins, begins + 4.0, (CAR, SPONGE)),
        )
        script = Script(spans, objects=dict.fromkeys(NAMES, (0.0, 1e9)), identities=NAMES)
        played = play(task_reasoner([parse_task(text.format("after 5 s"))]), script, 20.0, fps=5.0)
        assert (finish(task_of(played)) is Verdict.SUCCEEDED) == good

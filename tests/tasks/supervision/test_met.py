"""An approach is completed when the two have met since it was seen to begin."""

from __future__ import annotations

import pytest

from tests.tasks.scripted import RelationSpan, Script, task_of, watch
from visup.agent import Status, Verdict

TASK = """
<put>   ::= <bring> <on>
<bring> ::= converging(arm, satellite)
<on>    ::= touching(arm, satellite) for 3 s
"""
BRIEFLY = RelationSpan("converging", 1.0, 1.4)
MEETS = RelationSpan("touching", 4.0, 30.0)


def stages(script: Script, until: float, text: str = TASK) -> dict[str, Status]:
    return {s.stage: s.status for s in task_of(watch(script, until, text, fps=10.0)).stages}


def test_an_approach_of_which_little_was_seen_is_completed_by_contact() -> None:
    assert stages(Script((BRIEFLY, MEETS)), 4.8) == {"bring": Status.DONE, "on": Status.PROGRESSING}
    assert task_of(watch(Script((BRIEFLY, MEETS)), 8.0, TASK)).verdict is Verdict.SUCCEEDED


def test_without_contact_it_goes_on() -> None:
    assert stages(Script((BRIEFLY,)), 4.8)["on"] is Status.PENDING


@pytest.mark.parametrize(
    "script",
    [
        Script((MEETS,)),  # it was never seen to begin
        Script((RelationSpan("touching", 0.5, 30.0), RelationSpan("converging", 1.0, 1.4))),
        Script((BRIEFLY, RelationSpan("diverging", 1.4, 30.0), MEETS)),  # it fails
    ],
)
def test_contact_alone_completes_no_approach(script: Script) -> None:
    assert stages(script, 4.8)["on"] is Status.PENDING


def test_contact_of_others_completes_no_approach() -> None:
    text = TASK.replace("touching(arm, satellite)", "touching(arm, dish)")
    objects = {1: (0.0, 1e9), 2: (0.0, 1e9), 3: (0.0, 1e9)}
    met = RelationSpan("touching", 4.0, 30.0, objects=(1, 3))
    assert stages(Script((BRIEFLY, met), objects=objects), 4.8, text)["on"] is Status.PENDING

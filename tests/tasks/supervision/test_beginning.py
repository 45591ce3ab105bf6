"""When a stage is told to have begun: once something of it is seen, and not before."""

from __future__ import annotations

import pytest

from tests.tasks.scripted import ARM, IDENTITIES, INTRUDER, SATELLITE, Script, Spell, watch

APPROACH = "<t> ::= converging(arm, satellite)"
THREE = {ARM: (0.0, 1e9), SATELLITE: (0.0, 1e9), INTRUDER: (0.0, 1e9)}


def begun(script: Script, text: str, until: float = 14.0) -> dict[str, float]:
    events = watch(script, until, text).events
    return {str(e.data["stage"]): e.time for e in events if e.kind == "stage_started"}


def test_two_that_rest_from_the_start_begin_nothing() -> None:
    assert begun(Script(), APPROACH) == {}


@pytest.mark.parametrize("since", [2.0, 5.5])
def test_two_that_rest_begin_when_they_near_each_other(since: float) -> None:
    script = Script((Spell("converging", since, 12.0),))
    assert begun(script, APPROACH)["t"] == pytest.approx(since, abs=0.3)


def test_who_comes_later_begins_the_task_by_coming() -> None:
    objects = {ARM: (0.0, 1e9), SATELLITE: (3.0, 1e9)}
    assert begun(Script(objects=objects), APPROACH)["t"] == pytest.approx(3.0, abs=0.11)


def carried(*spells: Spell) -> Script:
    held = Spell("touching", 2.0, 20.0), Spell("coupled", 2.5, 20.0)
    return Script((Spell("converging", 0.5, 2.0), *held, *spells), THREE, identities=IDENTITIES)


CARRY = """
actor dish is dish
<t>     ::= <reach> <grasp> <carry>
<reach> ::= converging(arm, satellite)
<grasp> ::= coupled(arm, satellite)
<carry> ::= moving_together(arm, satellite) & converging(satellite, dish)
"""


def test_a_stage_of_two_things_begins_with_the_first_that_comes_about() -> None:
    nears = Spell("converging", 8.0, 12.0, (SATELLITE, INTRUDER))
    script = carried(Spell("moving_together", 5.0, 12.0), nears)
    assert begun(script, CARRY)["carry"] == pytest.approx(5.0, abs=0.4)


def test_what_the_stage_before_asked_for_already_does_not_begin_the_next() -> None:
    text = CARRY.replace("coupled(arm, satellite)", "moving_together(arm, satellite)")
    nears = Spell("converging", 8.0, 12.0, (SATELLITE, INTRUDER))
    script = carried(Spell("moving_together", 3.0, 12.0), nears)
    assert begun(script, text)["carry"] == pytest.approx(8.0, abs=0.4)

"""Beginnings that coincide, and what goes wrong before a stage has begun."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.tasks.scripted import Script, Spell, play
from visup.agent import Relation, Status, Truth
from visup.tasks import parse_task
from visup.tasks.automaton.entries import Meetings, StepEntries, coincidence, observed_entries
from visup.tasks.automaton.states import TaskStep
from visup.tasks.supervision.supervise import task_reasoner

CARRY = """<t> ::= <carry> <place>
<carry> ::= converging(arm, satellite)
<place> ::= touching(arm, satellite) & coupled(arm, satellite)
"""
APPROACHED = """<t> ::= <seen> <near> <place>
<seen> ::= present(satellite)
<near> ::= converging(arm, satellite)
<place> ::= touching(arm, satellite)
"""

spans = st.lists(
    st.tuples(st.integers(0, 9), st.integers(0, 9)).map(lambda p: (min(p), max(p))), min_size=1
)


@given(spans)
def test_a_coincidence_is_the_last_time_that_lies_in_all(found: list[tuple[int, int]]) -> None:
    everywhere = [t for t in range(10) if all(a <= t <= b for a, b in found)]
    assert coincidence(found) == max(everywhere, default=None)


@given(st.lists(st.tuples(st.booleans(), st.booleans(), st.booleans()), min_size=1))
def test_steps_have_met_if_both_held_since_either_was_last_refuted(
    moments: list[tuple[bool, bool, bool]],
) -> None:
    first, second = (TaskStep(name, (), "s") for name in ("a", "b"))
    found: tuple[StepEntries, Meetings] = ((), ())
    for now, (one, other, refuted) in enumerate(moments):
        true = {first: one and not refuted, second: other}
        entry = {s: Relation(s.action, (1,), Truth.TRUE, now) for s in true if true[s]}
        none = {first} if refuted else set[TaskStep]()
        found = observed_entries(
            found, [(first, second)], entry.get, now, refuted=none.__contains__
        )
    anew = max((i for i, m in enumerate(moments) if m[2]), default=-1) + 1
    together = any(a and b for a, b, _ in moments[anew:])
    assert dict(found[1]).get((first, second), -1) == max(
        (i for i, (a, b, _) in enumerate(moments) if i >= anew and a and b), default=-1
    )
    assert bool(found[1]) == together


def test_nothing_coincides_with_nothing() -> None:
    assert coincidence([]) is None


def stages(text: str, spells: tuple[Spell, ...], seconds: float) -> dict[str, set[Status]]:
    """All statuses that each stage was believed to have."""
    played = play(task_reasoner([parse_task(text)]), Script(spells), seconds)
    found: dict[str, set[Status]] = {}
    for mind in played.minds:
        for stage in mind.tasks[0].stages:
            found.setdefault(stage.stage, set()).add(stage.status)
    return found


@pytest.mark.parametrize("text", [CARRY, APPROACHED])
def test_what_turns_back_before_the_next_stage_fails_in_the_stage_that_lasts(text: str) -> None:
    turns = (Spell("converging", 0.5, 5.0), Spell("diverging", 5.5, 12.0))
    found = stages(text, turns, 10.0)
    lasting = "carry" if "carry" in found else "near"
    assert Status.FAILING in found[lasting]
    assert found["place"] == {Status.PENDING}


@pytest.mark.parametrize(("coupled_until", "done"), [(5.5, True), (5.1, True), (2.0, False)])
def test_one_entry_may_be_doubted_when_another_is_confirmed(
    coupled_until: float, done: bool
) -> None:
    told = (
        Spell("converging", 0.5, 5.0),
        Spell("coupled", 1.0, coupled_until),
        Spell("touching", 4.9, 9.0),
    )
    found = stages(CARRY, told, 8.0)
    assert (Status.DONE in found["place"]) is done

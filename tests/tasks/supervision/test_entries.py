"""Beginnings that coincide, and what goes wrong before a stage has begun."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.tasks.scripted import ARM, INTRUDER, SATELLITE, RelationSpan, Script, play
from visup.agent import Relation, Status, Truth
from visup.tasks import parse_task
from visup.tasks.automaton.entries import (
    Meetings,
    StepEntries,
    StepEntry,
    coincidence,
    held_on_entry,
    observed_entries,
)
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
def test_a_coincidence_is_the_last_time_that_lies_in_all(intervals: list[tuple[int, int]]) -> None:
    common = [t for t in range(10) if all(a <= t <= b for a, b in intervals)]
    assert coincidence(intervals) == max(common, default=None)


@given(st.lists(st.tuples(st.booleans(), st.booleans(), st.booleans()), min_size=1))
def test_steps_have_met_if_both_held_since_either_was_last_refuted(
    moments: list[tuple[bool, bool, bool]],
) -> None:
    first, second = (TaskStep(name, (), "s") for name in ("a", "b"))
    entries: tuple[StepEntries, Meetings] = ((), ())
    for now, (first_holds, second_holds, refuted) in enumerate(moments):
        true = {first: first_holds and not refuted, second: second_holds}
        entry = {s: Relation(s.action, (1,), Truth.TRUE, now) for s in true if true[s]}
        none = {first} if refuted else set[TaskStep]()
        entries = observed_entries(
            entries, [(first, second)], entry.get, now, refuted=none.__contains__
        )
    start = max((i for i, m in enumerate(moments) if m[2]), default=-1) + 1
    together = any(a and b for a, b, _ in moments[start:])
    assert dict(entries[1]).get((first, second), -1) == max(
        (i for i, (a, b, _) in enumerate(moments) if i >= start and a and b), default=-1
    )
    assert bool(entries[1]) == together


def test_nothing_coincides_with_nothing() -> None:
    assert coincidence([]) is None


def stages(text: str, spans: tuple[RelationSpan, ...], seconds: float) -> dict[str, set[Status]]:
    """All statuses that each stage was believed to have."""
    played = play(task_reasoner([parse_task(text)]), Script(spans), seconds)
    statuses: dict[str, set[Status]] = {}
    for mind in played.minds:
        for stage in mind.tasks[0].stages:
            statuses.setdefault(stage.stage, set()).add(stage.status)
    return statuses


@pytest.mark.parametrize("text", [CARRY, APPROACHED])
def test_turning_back_before_the_next_stage_fails_the_current_one(text: str) -> None:
    turns = (RelationSpan("converging", 0.5, 5.0), RelationSpan("diverging", 5.5, 12.0))
    statuses = stages(text, turns, 10.0)
    lasting = "carry" if "carry" in statuses else "near"
    assert Status.FAILING in statuses[lasting]
    assert statuses["place"] == {Status.PENDING}


@pytest.mark.parametrize(("coupled_until", "done"), [(5.5, True), (5.1, True), (2.0, False)])
def test_a_stage_begins_though_one_step_is_doubted_while_the_other_is_confirmed(
    coupled_until: float, done: bool
) -> None:
    relation_spans = (
        RelationSpan("converging", 0.5, 5.0),
        RelationSpan("coupled", 1.0, coupled_until),
        RelationSpan("touching", 4.9, 9.0),
    )
    statuses = stages(CARRY, relation_spans, 8.0)
    assert (Status.DONE in statuses["place"]) is done


PUT = """actor arm is arm
actor satellite is satellite
actor dish is dish
<t> ::= <carry> <place> <release> <retreat>
<carry> ::= moving_together(arm, satellite) & converging(satellite, dish)
<place> ::= touching(satellite, dish) & coupled(arm, satellite)
<release> ::= decoupled(arm, satellite) & touching(satellite, dish)
<retreat> ::= diverging(arm, satellite) for 0.3 s
"""


@pytest.mark.parametrize(("coupled_until", "done"), [(5.0, True), (4.6, False)])
def test_a_step_that_held_until_the_other_was_confirmed_counts_as_concurrent(
    coupled_until: float, done: bool
) -> None:
    """A gripper opens as it sets a part down: its hold is in doubt before the contact is confirmed."""
    hold, meeting = (ARM, SATELLITE), (SATELLITE, INTRUDER)
    relation_spans = (
        RelationSpan("moving_together", 1.0, 4.95, hold),
        RelationSpan("converging", 2.5, 4.7, meeting),
        RelationSpan("touching", 4.9, 12.0, meeting),
        RelationSpan("touching", 0.5, 5.5, hold),
        RelationSpan("coupled", 1.0, coupled_until, hold),
        RelationSpan("coupled", coupled_until, 5.1, hold, truth=Truth.UNKNOWN),
        RelationSpan("diverging", 5.3, 12.0, hold),
    )
    script = Script(relation_spans, dict.fromkeys((ARM, SATELLITE, INTRUDER), (0.0, 1000000000.0)))
    played = play(task_reasoner([parse_task(PUT)]), script, 10.0, fps=10.0)
    fails = [
        m.time
        for m in played.minds
        for s in m.tasks[0].stages
        if s.stage == "place" and s.status is Status.FAILING
    ]
    assert (not fails) is done


OPENED, CLOSED = TaskStep("opened", (), "s"), TaskStep("closed", (), "s")
HOLD = Relation("opened", (1,), Truth.TRUE, 1.0)


@pytest.mark.parametrize(
    ("held_at", "holding", "expected"),
    [
        (2.0, {CLOSED}, {OPENED: HOLD}),
        (1.4, {CLOSED}, {}),
        (2.0, set(), {}),
        (2.0, {OPENED, CLOSED}, {}),
    ],
)
def test_a_step_held_on_entry_if_it_held_when_the_other_one_began(
    held_at: float, holding: set[TaskStep], expected: dict[TaskStep, Relation]
) -> None:
    by_step = {OPENED: StepEntry(1.0, 2.0, HOLD, held_at), CLOSED: StepEntry(1.5, 2.2)}
    entries = tuple(by_step.items())
    assert held_on_entry(entries, (OPENED, CLOSED), holding.__contains__) == expected
    assert held_on_entry(entries[:1], (OPENED, CLOSED), holding.__contains__) == {}


def test_an_entry_remembers_when_the_step_last_held() -> None:
    near = {OPENED: Relation("near", (1,), Truth.TRUE, 0.0)}
    entries: tuple[StepEntries, Meetings] = ((), ())
    for now, holds in enumerate([False, True, True, False]):
        holding = {OPENED: HOLD} if holds else {}
        entries = observed_entries(entries, [(OPENED,)], near.get, now, held_by=holding.get)
    assert dict(entries[0])[OPENED] == StepEntry(0.0, 3, HOLD, 2)

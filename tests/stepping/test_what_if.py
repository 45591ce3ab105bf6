"""What if: a branch holds to its beliefs, and leaves the course that it left as it was."""

from __future__ import annotations

import pytest

from tests.stepping.timelines import reasoning_bytes, reasoning_course, reasoning_stepper, told
from visup.agent import Presence, Relation, RelationTable, Truth
from visup.agent.model.errors import SettingsError
from visup.rules.language.parser import parse_rules
from visup.stepping import Stepper
from visup.stepping.what_if import (
    AssumedIdentity,
    AssumedPresence,
    AssumedRelation,
    Assumption,
    with_relation,
    with_rules,
    with_tasks,
)
from visup.tasks import load_tasks
from visup.terminal.what_if_commands import parse_assumption

RULE = parse_rules('rule seen_one(a): info when seen(a) say "{a} is seen."')


def at(number: int = 30) -> Stepper:
    it = reasoning_stepper()
    it.step(number)
    return it


@pytest.mark.parametrize(
    "belief",
    [
        AssumedRelation("touching", (1, 3), Truth.TRUE, 1.2),
        AssumedRelation("coupled", (1, 2), Truth.TRUE, 1.2),
        AssumedRelation("diverging", (1, 3), Truth.FALSE, 1.2),
        AssumedRelation("converging", (3, 1), Truth.TRUE, 1.2),
        AssumedRelation("touching", (1, 2), Truth.UNKNOWN, 1.2),
        AssumedIdentity(2, "arm"),
        AssumedIdentity(1, "unknown object"),
        AssumedPresence(3, Presence.LEFT),
        AssumedPresence(1, Presence.HIDDEN),
    ],
)
def test_a_branch_enforces_its_assumption_and_its_parent_is_unchanged(belief: Assumption) -> None:
    it = at()
    branch = it.branch(belief)
    assert is_so(branch, belief)
    for _ in range(20):
        branch.step()
        assert is_so(branch, belief)
    assert it.at == 30
    real: list[bytes] = []
    it.step(20, on_step=lambda step: real.append(told(step)))
    assert real == list(reasoning_bytes()[30:50])


def is_so(it: Stepper, belief: Assumption) -> bool:
    mind = it.mind
    match belief:
        case AssumedRelation(name=name, objects=objects, truth=truth, since=since):
            found = mind.relation(name, *objects)
            coupled = name != "coupled" or mind.coupled(*objects) is (truth is Truth.TRUE)
            measured = truth is not Truth.TRUE  # what is measured so anyway has its own time
            return (
                found is not None
                and found.truth is truth
                and coupled
                and (measured or found.since == since)
            )
        case AssumedIdentity(object_id=number, name=name):
            return (mind.objects[number].name, mind.objects[number].confidence) == (name, 1.0)
        case AssumedPresence(object_id=number, presence=presence):
            return mind.objects[number].presence is presence
    return False


def test_a_branch_without_assumptions_equals_its_parent() -> None:
    it = at(17)
    branch = it.branch()
    made: list[bytes] = []
    branch.step(30, on_step=lambda step: made.append(told(step)))
    assert made == list(reasoning_bytes()[17:47])
    assert not branch.compare()
    assert it.at == 17
    branch.back(20)
    assert told(branch.last) == reasoning_bytes()[26]
    with pytest.raises(SettingsError, match="at least 17"):
        branch.go(16)


def test_other_rules_and_tasks_apply_on_a_branch() -> None:
    it = at(10)
    rules = it.branch(reasoners=with_rules(it.agent.reasoners, RULE))
    rules.step(20)
    changed = rules.compare()
    assert {e["data"]["alert_kind"] for e in changed.new if e["kind"] == "alert"} == {"seen_one"}
    assert [e["data"]["alert_kind"] for e in changed.gone if e["kind"] == "alert"] == [
        "unexpected_object"
    ]
    task = it.branch(reasoners=with_tasks(it.agent.reasoners, load_tasks("undock")))
    task.step(5)
    assert [t.task for t in task.mind.tasks] == ["undock"]
    none = it.branch(reasoners=with_tasks(it.agent.reasoners, ()))
    none.step(5)
    assert none.mind.tasks == ()
    assert [t.task for t in it.mind.tasks] == ["dock"]


def test_an_answer_in_the_past_starts_a_branch() -> None:
    it = at(40)
    it.go(30)
    branch = it.branch()
    branch.answer(2, "arm")
    branch.step(10)
    changed = branch.compare()
    assert next(e["kind"] for e in changed.new) == "answer"
    assert branch.mind.objects[2].name == "arm"
    assert it.mind_at(40).objects[2].name == "hubble"
    with pytest.raises(SettingsError, match="this is not a branch"):
        it.compare()


def test_a_relation_is_replaced_and_no_other() -> None:
    table = reasoning_course()[-1].mind.relations
    assert isinstance(table, RelationTable)
    other = with_relation(table, Relation("touching", (3, 2), Truth.TRUE, 0.5))

    def true(relations: RelationTable) -> set[tuple[str, tuple[int, ...]]]:
        return {(r.name, r.objects) for r in relations.all() if r.truth is Truth.TRUE}

    assert isinstance(other, RelationTable)
    assert true(other) - true(table) == {("touching", (2, 3))}
    assert true(table) <= true(other)


GOOD = {
    "touching 1 2": AssumedRelation("touching", (1, 2), Truth.TRUE, 2.36),
    "relation touching(2, 1) false": AssumedRelation("touching", (2, 1), Truth.FALSE, 2.36),
    "object 2 arm": AssumedIdentity(2, "arm"),
    "object 1 satellite": AssumedIdentity(1, "spartan"),
    "object 3 hidden": AssumedPresence(3, Presence.HIDDEN),
    "object 1 unknown": AssumedIdentity(1, "unknown object"),
}


@pytest.mark.parametrize("text", list(GOOD))
def test_assumptions_can_be_given_as_text(text: str) -> None:
    assert parse_assumption(reasoning_course()[-1].mind, text.split()) == GOOD[text]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "no belief was given"),
        ("touchin 1 2", "did you mean 'touching'"),
        ("touching 1", "not a relation of two objects"),
        ("touching 1 2 maybe", "not a relation of two objects"),
        ("touching 1 9", "there is no object 9"),
        ("object 9 arm", "there is no object 9"),
        ("object arm", "an object and a belief"),
        ("object 1", "an object and a belief"),
        ("object 1 arn", "did you mean 'arm'"),
    ],
)
def test_invalid_assumptions_are_refused_with_a_message(text: str, said: str) -> None:
    with pytest.raises(SettingsError) as fault:
        parse_assumption(reasoning_course()[-1].mind, text.split())
    assert said in str(fault.value)


def test_a_belief_is_retracted() -> None:
    mind = reasoning_course()[-1].mind
    assert parse_assumption(mind, ["touching", "1", "2"], retract=True) == AssumedRelation(
        "touching", (1, 2), Truth.UNKNOWN, mind.time
    )
    assert parse_assumption(mind, ["object", "1"], retract=True) == AssumedIdentity(
        1, "unknown object"
    )

"""The operator is asked when two names stay close; the answer is a fact."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from tests.rules.scenes import SIZE, box_region, seen
from visup.agent import Frame, Observation, Percept, Region
from visup.agent.contract.behaviour import Contract
from visup.agent.cycle.agent import Agent, Reasoners
from visup.agent.model.errors import SettingsError
from visup.agent.model.step import Step
from visup.rules.identity.operator_questions import question_text
from visup.rules.reasoners import default_reasoners
from visup.runs.operator import HumanOperator, parse_answers

BLANK = np.broadcast_to(np.zeros((1, 1, 1), np.uint8), (SIZE[1], SIZE[0], 3))
Said = dict[int, list[tuple[str, float]]]


class Scripted:
    contract = Contract("script", gives=("region", "hypothesis", "health"))

    def __init__(self, at: Callable[[int], Observation]) -> None:
        self.at = at

    def perceive(self, frame: Frame, *_: object) -> list[Percept]:
        reports = self.at(frame.index).reports
        return [replace(p, source="script") for r in reports for p in r.percepts]


def agent_of(at: Callable[[int], Observation]) -> Agent:
    rules = default_reasoners()
    return Agent(
        behaviours=[Scripted(at)],
        reasoners=Reasoners(rules.update, rules.cogitate),
        actors={"arm": ("rms_arm",), "guitar": ("guitar",)},
    )


def steps(agent: Agent, first: int, last: int) -> list[Step]:
    return [agent.step(Frame(i, i / 25, BLANK)) for i in range(first, last)]


def both(i: int) -> list[tuple[str, float]]:
    """Two names that take turns, neither better, and both awaited."""
    return (
        [("rms_arm", 0.7), ("guitar", 0.69)] if i // 5 % 2 else [("guitar", 0.7), ("rms_arm", 0.69)]
    )


def doubtful(i: int, hidden: range = range(0)) -> Observation:
    boxes: list[Region | None] = [] if i in hidden else [box_region(1, (200, 150, 90, 70))]
    return seen(i, boxes, names={1: both(i)} if boxes and i % 5 == 0 else {})


def asked(told: list[Step]) -> list[str]:
    return [e.text for s in told for e in s.events if e.kind == "question"]


def test_names_that_stay_close_are_asked_about_once() -> None:
    agent = agent_of(doubtful)
    told = steps(agent, 0, 200)
    assert len(asked(told)) == 1
    assert asked(told)[0] in (
        "Is object 1 the arm or the guitar?",
        "Is object 1 the guitar or the arm?",
    )
    assert [d.data["object"] for d in told[-1].directives if d.kind == "ask"] == [1]
    assert told[-1].mind.questions[0].names in (("rms_arm", "guitar"), ("guitar", "rms_arm"))


def test_a_name_that_is_clear_is_not_asked_about() -> None:
    at = lambda i: seen(i, [box_region(1, (200, 150, 90, 70))], names={1: [("probe", 0.8)]})  # noqa: E731
    assert asked(steps(agent_of(at), 0, 200)) == []


def test_the_answer_settles_the_vote_and_is_kept_out_of_sight() -> None:
    agent = agent_of(lambda i: doubtful(i, range(200, 280)))
    steps(agent, 0, 150)
    agent.answer(1, "arm")
    first = steps(agent, 150, 151)[0]
    told = [e.text for e in first.events if e.kind == "answer"]
    assert told == ["The operator says that object 1 is the arm."]
    assert first.mind.questions == ()
    for step in steps(agent, 151, 400):
        belief = step.mind.objects[1]
        assert (belief.name, belief.confidence, len(belief.candidates)) == ("rms_arm", 1.0, 1)
        assert step.mind.questions == ()


def test_none_of_the_models_is_an_answer() -> None:
    agent = agent_of(doubtful)
    steps(agent, 0, 60)
    agent.answer(1, "unknown")
    belief = steps(agent, 60, 120)[-1].mind.objects[1]
    assert (belief.name, belief.confidence) == ("unknown object", 1.0)


@pytest.mark.parametrize(
    ("number", "name", "what"),
    [(7, "arm", "no object 7"), (1, "gitar", "gitar"), (1, "", "neither a model nor an actor")],
)
def test_answers_that_cannot_be_are_refused_in_the_users_words(
    number: int, name: str, what: str
) -> None:
    agent = agent_of(doubtful)
    steps(agent, 0, 60)
    with pytest.raises(SettingsError) as refused:
        agent.answer(number, name)
    assert what in str(refused.value)
    if name == "gitar":
        assert refused.value.hint == "did you mean 'guitar'?"


def test_what_is_typed_or_given_beforehand_reaches_the_mind() -> None:
    typed = [[], ["nonsense\n"], ["1=guitar\n"]]
    said: list[str] = []
    agent = agent_of(doubtful)
    operator = HumanOperator(typed=lambda: typed.pop(0) if typed else [], tell=said.append)
    agent.observers = (operator.attend(agent),)
    assert steps(agent, 0, 60)[-1].mind.answers == {1: "guitar"}
    assert "cannot be read" in said[0]
    early = agent_of(doubtful)
    early.observers = (HumanOperator({1: "arm"}).attend(early),)
    assert steps(early, 0, 60)[-1].mind.answers == {1: "rms_arm"}
    with pytest.raises(SettingsError):
        HumanOperator({1: "nobody"}).attend(agent_of(doubtful))


def test_a_name_typed_before_the_question_could_be_read_is_no_answer() -> None:
    asked: list[float] = []
    agent = agent_of(doubtful)

    def typed() -> list[str]:
        """A name in the very step that asks; one with its object's id would do."""
        new = [q.asked for q in agent.mind.questions if q.asked not in asked]
        asked.extend(new)
        return ["guitar\n"] if new else []

    agent.observers = (HumanOperator(typed=typed, tell=lambda text: None).attend(agent),)
    last = steps(agent, 0, 120)[-1]
    assert asked
    assert not last.mind.answers


@pytest.mark.parametrize("line", ["arm", "=arm", "x=arm", "2="])
def test_lines_that_are_no_answers_are_refused(line: str) -> None:
    with pytest.raises(SettingsError):
        parse_answers([line])


def test_three_names_are_asked_about_in_words() -> None:
    mind = agent_of(doubtful).mind
    assert (
        question_text(mind, 3, ("a_b", "rms_arm", "c")) == "Is object 3 the a b, the arm or the c?"
    )

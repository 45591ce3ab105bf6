"""Reasons go down to percepts; what is missing is told with its amount."""

from __future__ import annotations

import pytest

from tests.stepping.timelines import reasoning_stepper
from visup.agent import Hypothesis, Region
from visup.agent.model.errors import VisupError
from visup.stepping import Stepper
from visup.stepping.explanations.evidence import Why
from visup.stepping.explanations.why import REPORTED_HEADING
from visup.terminal.display import html, shown


@pytest.fixture(scope="module")
def it() -> Stepper:
    stepper = reasoning_stepper(100)
    stepper.step(100)
    return stepper


def test_an_alert_is_explained_by_the_percepts_of_its_opening_frame(it: Stepper) -> None:
    why = it.why("alert 1")
    assert (why.frame_index, why.text.split(":")[0]) == (15, "alert 1, unexpected_object")
    texts = [w.text for w in why.walk()]
    assert "in_view(object 2) > 0.5 s is true, by 0.1" in texts
    found = [p.value for p in why.percepts]
    assert [p.time for p in why.percepts] == [0.6] * len(found)
    assert [v.id for v in found if isinstance(v, Region)] == [2]
    assert {v.name for v in found if isinstance(v, Hypothesis)} == {"hubble", "arm"}
    seen = it.observation_at(16)
    assert {id(type(v)) for v in found} <= {id(type(v)) for k in KINDS for v in seen.of(k)}


KINDS = ("region", "hypothesis", "depth")

TOLD = {
    "verdict": ("the verdict on dock is interrupted", "unexpected_object(object 2) is true"),
    "approach": ("stage approach: failing", "the arm and the satellite have been diverging"),
    "stage captured": ("stage captured: pending", "arm is bound to object 3"),
    "touching 1 2": ("touching(the satellite, the hubble) has been false", "its value is"),
    "coupled 1 3": ("coupled(the satellite, the arm) is false", "touching"),
    "identity 1": ("object 1 is spartan", "votes, share"),
    "object 3": ("object 3 is believed to be seen", "first seen at 0.00 s"),
    "collision_course 1 2": ("collision_course(the", "converging("),
    "rule unexpected_object 2": ("unexpected_object(the hubble) is true", "in_view"),
}


@pytest.mark.parametrize("text", TOLD)
def test_why_has_its_reasons_and_its_percepts(it: Stepper, text: str) -> None:
    why = it.why(text)
    head, below = TOLD[text]
    assert why.text.startswith(head)
    assert any(below in w.text for w in why.walk())
    assert any(isinstance(p.value, Region | Hypothesis) for p in why.percepts)
    assert "`" not in str(why)  # as the narrative has it


def test_a_stage_is_explained_with_what_was_last_reported_of_it(it: Stepper) -> None:
    reported = next(w for w in it.why("approach").walk() if w.text == REPORTED_HEADING)
    assert reported.parts
    assert all("Stage 'approach'" in w.line() for w in reported.parts)


def test_records_can_be_explained_directly(it: Stepper) -> None:
    mind = it.mind
    asked = [mind.alerts[0], mind.objects[1], mind.tasks[0], mind.tasks[0].stages[0]]
    asked += [next(iter(mind.relations))]
    assert all(it.why(what).percepts for what in asked)


def test_every_event_has_a_reason_that_ends_in_percepts(it: Stepper) -> None:
    told = [e for _, e in it.events()]
    assert {e.kind for e in told} >= {"entry", "identified", "alert", "verdict", "relation"}
    for event in told:
        why = it.why(event)
        assert why.frame_index == event.frame_index
        assert why.percepts, event.kind


MISSING = {
    "coupled 1 2": "log odds that they touch and are at rest 0 of 3.5: 3.5 short",
    "collision_course": "time_to_contact(",
    "collision_course 1 2": "converging(the satellite, the hubble) is false",
    "stage captured": "before it, approach is failing",
    "captured": "awaited: coupled(the arm, the satellite) is false",
    "approach": "stage approach has begun",
    "exit 2": "visible share 1, less than 0.12 is needed",
    "occlusion 1": "visible share 1, less than 0.2 is needed",
    "reappearance 1": "object 1 is seen",
    "identified 1": "was identified as spartan",
    "entry 1": "has entered",
    "touching 1 2": "its value is",
    "touching 1 9": "object 9 is not believed to be there",
    "unexpected_object": "alert 1 is open since 0.60 s",
}


@pytest.mark.parametrize("text", MISSING)
def test_unmet_conditions_are_explained(it: Stepper, text: str) -> None:
    assert any(MISSING[text] in w.text for w in it.why_not(text).walk())


def test_unmet_conditions_of_past_steps_are_explained() -> None:
    it = reasoning_stepper()
    it.step(6)
    entry = [w.text for w in it.why_not("entry 1").walk()]
    assert "seen steadily for 0.2 s of 0.36 s: 0.16 s short" in entry
    it.step(9)
    named = [w.text for w in it.why_not("identified 1").walk()]
    assert any("leads for" in w and w.endswith("short") for w in named)


@pytest.mark.parametrize(
    "text", ["", "nonsense", "alert 7", "object 9", "touching 1 9", "relation", "rule nothing 1"]
)
def test_unknown_subjects_are_refused_with_a_message(it: Stepper, text: str) -> None:
    with pytest.raises(VisupError):
        it.why(text)


@pytest.mark.parametrize("text", ["", "coupled 1", "object 1", "entry 9", "stage nothing"])
def test_invalid_why_not_questions_are_refused_with_a_message(it: Stepper, text: str) -> None:
    with pytest.raises(VisupError):
        it.why_not(text)


def test_reasons_have_a_display() -> None:
    why = Why("a", (Why("b", (Why("c"),)),), 3, 0.5)
    assert str(why) == "a [frame 3, 0.50 s]\n  b\n    c"
    assert "frame 3" in html(why)
    assert shown(why) is not None

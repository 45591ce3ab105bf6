"""What began because two met is taken back if they only passed each other, or part as another course says."""

from __future__ import annotations

from functools import partial

import pytest

from tests.tasks.scripted import ARM, INTRUDER, SATELLITE, RelationSpan, Script, ScriptedRun, watch
from tests.tasks.supervision.drawn import Mask, drawn, watched
from visup.agent import Event, Relation, Truth, Verdict
from visup.tasks.automaton.automaton import Transition
from visup.tasks.automaton.states import Leaf, TaskStep
from visup.tasks.supervision.hypotheses import TaskHypothesis
from visup.tasks.supervision.open_transitions import OpenTransition
from visup.tasks.verification.observation import ActionObservation
from visup.tasks.verification.step_monitor import entered

CRANE, TRUCK = 1, 2
SET_DOWN = """
<set_down> ::= <lower> <loaded>
<lower>    ::= converging(container, truck)
<loaded>   ::= touching(container, truck) for 2 s
"""
MEETS_S, HOVERS_S, SPEED = 3.0, 4.0, 60.0


def lowered(now: float, waits_s: float, ends_s: float) -> Mask:
    """A container that comes before a truck, waits there, goes on for a second or more, and stops."""
    moved = min(now, HOVERS_S) + min(max(0.0, now - HOVERS_S - waits_s), ends_s)
    right = 260 + SPEED * (moved - MEETS_S)
    return drawn({TRUCK: (260, 80, 180, 60), CRANE: (right - 70, 70, 70, 50)})


def told(events: list[Event], kind: str, stage: str) -> list[float]:
    return [e.time for e in events if e.kind == kind and e.data.get("stage") == stage]


@pytest.fixture(scope="module")
def hovers(tmp_path_factory: pytest.TempPathFactory) -> list[Event]:
    mask = partial(lowered, waits_s=0.8, ends_s=1.5)
    names = {"container": CRANE, "truck": TRUCK}
    return watched(tmp_path_factory.mktemp("hovers"), SET_DOWN, mask, names, 9.0)


def test_what_hovers_before_another_has_not_met_it(hovers: list[Event]) -> None:
    begun = told(hovers, "stage_started", "loaded")
    assert len(begun) == 2
    assert begun[0] < HOVERS_S + 0.8
    assert begun[1] > HOVERS_S + 0.8 + 1.5 - 0.1
    assert told(hovers, "stage_done", "loaded")


def test_the_approach_goes_on_and_does_not_begin_again(hovers: list[Event]) -> None:
    assert len(told(hovers, "stage_started", "lower")) == 1
    (revised,) = [e for e in hovers if e.kind == "stage_revised"]
    assert revised.text.startswith("Stage `lower`, reported complete at ")
    assert revised.text.endswith("is now believed still to be going on.")


RETRY = """
<charge>   ::= <approach> (<docked> | <back_off> <charge>)
<approach> ::= converging(arm, satellite)
<docked>   ::= touching(arm, satellite) for 2 s
<back_off> ::= diverging(arm, satellite)
"""
ONCE = RETRY.replace("(<docked> | <back_off> <charge>)", "<docked>").replace(
    "<back_off> ::= diverging(arm, satellite)\n", ""
)


def docking(touches_s: float, text: str = RETRY) -> ScriptedRun:
    """It comes near, touches for a while, and draws back; then it comes again and stays."""
    leaves = 4.0 + touches_s
    spans = (
        RelationSpan("converging", 1.0, 4.2),
        RelationSpan("touching", 4.0, leaves),
        RelationSpan("diverging", leaves, leaves + 3.0),
        RelationSpan("converging", leaves + 3.5, leaves + 6.0),
        RelationSpan("touching", leaves + 6.0, 30.0),
    )
    return watch(Script(spans), leaves + 10.0, text, fps=10.0)


def kinds(run: ScriptedRun, stage: str) -> list[str]:
    return [k for k, s in run.reported() if s == stage]


@pytest.mark.parametrize("touches_s", [0.5, 1.5])
def test_parting_before_its_time_is_the_other_course(touches_s: float) -> None:
    run = docking(touches_s)
    assert "stage_failing" not in kinds(run, "docked")
    assert "stage_started" in kinds(run, "back_off")
    assert kinds(run, "approach").count("stage_started") == 2
    assert run.minds[-1].tasks[0].verdict is Verdict.SUCCEEDED


def test_without_another_course_it_fails() -> None:
    assert "stage_failing" in kinds(docking(1.0, ONCE), "docked")


def test_what_has_lasted_as_long_as_required_is_not_taken_back() -> None:
    run = docking(2.6)
    assert kinds(run, "docked")[:3] == ["stage_started", "stage_progressing", "stage_done"]
    assert "stage_started" not in kinds(run, "back_off")


def test_another_course_counts_only_if_it_begins_by_the_parting() -> None:
    """That somebody else comes near just then is no reason for the two to part."""
    text = RETRY.replace("diverging(arm, satellite)", "converging(dish, satellite)")
    spans = (
        RelationSpan("converging", 1.0, 4.2),
        RelationSpan("touching", 4.0, 5.0),
        RelationSpan("diverging", 5.0, 9.0),
        RelationSpan("converging", 4.4, 9.0, objects=(SATELLITE, INTRUDER)),
    )
    objects = {ARM: (0.0, 1e9), SATELLITE: (0.0, 1e9), INTRUDER: (0.0, 1e9)}
    run = watch(Script(spans, objects), 5.7, f"actor dish is dish\n{text}", fps=10.0)
    assert "stage_revised" not in [e.kind for e in run.events]


@pytest.mark.parametrize("carried", [False, True])
def test_the_contact_of_a_carried_body_is_kept(carried: bool) -> None:
    step = TaskStep("touching", ("part", "fixture"), "place")
    state = Leaf(step, entered(0.0))
    touches = Relation("touching", (1, 2), Truth.TRUE, 0.5)
    seen = ActionObservation(held_by=touches, carried=carried)
    taken = OpenTransition(Transition(0, (), (), 1.0), (), (step,), None)
    entry = taken.contact_entry(TaskHypothesis(state, 0), lambda s: seen, 1.0)
    assert (entry is None) is carried

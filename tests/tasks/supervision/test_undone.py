"""What undoes a hold, what goes on after a broken invariant, and what is expected of those who carry."""

from __future__ import annotations

import math

import pytest

from tests.tasks.scripted import (
    ARM,
    IDENTITIES,
    INTRUDER,
    SATELLITE,
    RelationSpan,
    Script,
    play,
    task_of,
    watch,
)
from visup.agent import Coupling, Expectation, Mind, Observation, Outcome, Status, Truth
from visup.agent.model.fast_replace import replace
from visup.tasks import parse_task
from visup.tasks.automaton.states import Leaf, ParallelState, TaskStep
from visup.tasks.supervision.hypotheses import TaskHypothesis
from visup.tasks.supervision.monitored_phases import brought_along
from visup.tasks.supervision.supervise import task_reasoner
from visup.tasks.verification.step_monitor import entered

THREE = {ARM: (0.0, 1e9), SATELLITE: (0.0, 1e9), INTRUDER: (0.0, 1e9)}
MEETS = RelationSpan("converging", 0.5, 2.0), RelationSpan("touching", 2.0, 20.0)

CAPTURE = """
<t>        ::= <approach> <captured>
<approach> ::= converging(arm, satellite)
<captured> ::= coupled(arm, satellite)
"""

LIFT = """
<t>     ::= <reach> <grasp> <lift>
<reach> ::= converging(arm, satellite)
<grasp> ::= coupled(arm, satellite)
<lift>  ::= moving_together(arm, satellite) fails when apart(arm, satellite)
"""

CARRY = """
actor dish is dish
<t>     ::= <reach> <carry>
<reach> ::= converging(arm, satellite)
<carry> ::= moving_together(arm, satellite) & converging(satellite, dish)
"""

KEEP_OFF = f"actor dish is dish{CAPTURE}never touching(arm, dish)\n"


def failing(script: Script, text: str) -> set[str]:
    """The stages that are told to fail."""
    events = watch(script, 14.0, text).events
    return {str(e.data["stage"]) for e in events if e.kind == "stage_failing"}


@pytest.mark.parametrize(
    ("gap", "contact", "fails"),
    [
        (0.0, True, False),  # fingers close, and seem to recede
        (5.0, True, True),
        (0.0, False, True),  # it may pass in front
        (math.nan, True, True),
    ],
)
def test_objects_in_contact_do_not_diverge(gap: float, contact: bool, fails: bool) -> None:
    later = Truth.TRUE if contact else Truth.UNKNOWN
    meets = RelationSpan("in_contact", 2.0, 3.0), RelationSpan("in_contact", 3.0, 20.0, truth=later)
    spans = (*MEETS, *meets, RelationSpan("diverging", 4.0, 9.0))
    known = (*Script().known, "in_contact")
    script = Script(spans, gaps=lambda now: gap, known=known)
    assert failing(script, CAPTURE) == ({"captured"} if fails else set())


@pytest.mark.parametrize(
    ("moved_s", "again", "fails"),
    [
        (0.0, False, "grasp"),  # nothing was taken along
        (1.5, False, "lift"),
        (0.0, True, "grasp"),  # a second try is another grasp
    ],
)
def test_a_grasp_without_motion_of_the_part_fails(moved_s: float, again: bool, fails: str) -> None:
    hold_spans = RelationSpan("touching", 2.0, 6.0), RelationSpan("coupled", 2.5, 6.0)
    spans: tuple[RelationSpan, ...] = (
        RelationSpan("converging", 0.5, 2.0),
        *hold_spans,
        RelationSpan("diverging", 6.0, 9.0),
    )
    spans += (RelationSpan("moving_together", 6.0 - moved_s, 6.0),) if moved_s else ()
    spans += (
        (RelationSpan("converging", 9.0, 10.0), RelationSpan("moving_together", 10.0, 10.5))
        if again
        else ()
    )
    assert failing(Script(spans), LIFT) == {fails}


@pytest.mark.parametrize(
    ("together_s", "fails"),
    [
        (0.0, "grasp"),  # the dish, or a push, brings the two nearer: nothing was taken along
        (1.5, "lift"),
    ],
)
def test_a_part_that_moves_without_its_gripper_was_not_grasped(
    together_s: float, fails: str
) -> None:
    lift = "moving_together(arm, satellite) & converging(satellite, dish)\n  fails"
    text = LIFT.replace("moving_together(arm, satellite) fails", lift)
    nears = RelationSpan("converging", 4.5, 12.0, (SATELLITE, INTRUDER))
    hold_spans = RelationSpan("touching", 2.0, 6.0), RelationSpan("coupled", 2.5, 6.0)
    spans: tuple[RelationSpan, ...] = (
        RelationSpan("converging", 0.5, 2.0),
        *hold_spans,
        RelationSpan("diverging", 6.0, 9.0),
    )
    spans += (RelationSpan("moving_together", 6.0 - together_s, 6.0),) if together_s else ()
    script = Script((*spans, nears), THREE, identities=IDENTITIES)
    assert failing(script, f"actor dish is dish{text}") == {fails}


@pytest.mark.parametrize("first", [True, False])
@pytest.mark.parametrize(
    ("going", "waiting", "begun"),
    [
        (("part",), ("gripper", "part"), False),  # it is pushed, or the camera drifts
        (("part", "dish"), ("gripper", "part"), True),
        (("gripper", "part"), ("part",), True),
    ],
)
def test_a_joint_action_does_not_begin_with_one_actor_alone(
    going: tuple[str, ...], waiting: tuple[str, ...], begun: bool, first: bool
) -> None:
    monitor = entered(4.0)
    goes = replace(monitor, status=Status.PROGRESSING, turn=4.0, first_since=5.0)
    waits = replace(monitor, status=Status.ACTIVE)
    parts = Leaf(TaskStep("a", going, "lift"), goes), Leaf(TaskStep("b", waiting, "lift"), waits)
    hypothesis = TaskHypothesis(ParallelState(parts if first else parts[::-1]), 0)
    status = hypothesis.under_way["lift"].payload.status
    assert status is (Status.PROGRESSING if begun else Status.ACTIVE)


def test_a_failure_with_a_third_object_undoes_no_grasp() -> None:
    text = LIFT.split("<lift>  ::=")[0] + "<lift>  ::= converging(satellite, dish)\n"
    text = f"actor dish is dish{text}"
    goes = (
        RelationSpan("coupled", 2.5, 20.0),
        RelationSpan("diverging", 5.0, 12.0, (SATELLITE, INTRUDER)),
    )
    assert failing(Script((*MEETS, *goes), THREE, identities=IDENTITIES), text) == {"lift"}


def started(script: Script) -> set[str]:
    """The stages that are told to begin while the arm must keep off the dish."""
    events = watch(script, 14.0, KEEP_OFF).events
    return {str(e.data["stage"]) for e in events if e.kind == "stage_started"}


def test_after_a_broken_invariant_no_stage_begins() -> None:
    captured = (
        RelationSpan("converging", 0.5, 8.0),
        RelationSpan("touching", 8.0, 20.0),
        RelationSpan("coupled", 8.5, 20),
    )
    touches = RelationSpan("touching", 4.0, 6.0, (ARM, INTRUDER))
    alone = Script(captured, THREE, identities=IDENTITIES)
    assert started(alone) == {"approach", "captured"}
    assert started(Script((*captured, touches), THREE, identities=IDENTITIES)) == {"approach"}
    # An alert may be false; what was seen of the stages is still told.
    alarmed = Script(
        captured, THREE, identities=IDENTITIES, alerts=[("collision_course", 4.0, 6.0)]
    )
    assert started(alarmed) == {"approach", "captured"}


def test_a_carrier_is_expected_at_the_destination_of_its_load() -> None:
    moves = RelationSpan("moving_together", 4.0, 12.0), RelationSpan("coupled", 2.5, 20.0)
    nears = RelationSpan("converging", 5.0, 12.0, (SATELLITE, INTRUDER))
    played = watch(Script((*MEETS, *moves, nears), THREE, identities=IDENTITIES), 10.0, CARRY)
    comes = Expectation("converging", (ARM, INTRUDER))
    assert comes in task_of(played, 8.0).expected
    assert Expectation("converging", (SATELLITE, INTRUDER)) in task_of(played, 8.0).expected


def test_only_carriers_are_expected_with_their_load() -> None:
    nears = (("part", "tray"), ("converging",))
    assert list(brought_along([nears])) == []
    assert list(brought_along([(("arm", "part"), ("touching",)), nears])) == []
    for holder in (("arm", "part"), ("part", "arm")):
        asked = [(holder, ("moving_together",)), nears]
        assert list(brought_along(asked)) == [(("arm", "tray"), ("converging",))]
    assert list(brought_along([(("tray", "part"), ("coupled",)), nears])) == []


@pytest.mark.parametrize(
    ("coupled", "name", "unexplained"),
    [
        ((), "", True),
        ((ARM, INTRUDER), "", False),  # the rest of the arm, or who hands it something
        ((ARM, INTRUDER), "dish", True),  # a known thing that plays no part
        ((INTRUDER, 9), "", True),  # it holds something else
    ],
)
def test_an_unknown_object_that_once_held_an_actor_stays_explained(
    coupled: tuple[int, int] | tuple[()], name: str, unexplained: bool
) -> None:
    reasoner = task_reasoner([parse_task(CAPTURE)])

    def think(before: Mind, observation: Observation) -> Outcome:
        couplings = (Coupling(coupled, 3.0),) if coupled and 3.0 <= before.time < 5.0 else ()
        return reasoner(replace(before, couplings=couplings), observation)

    names = {k: v for k, v in IDENTITIES.items() if k != INTRUDER} | (
        {INTRUDER: {name: 0.9}} if name else {}
    )
    script = Script(MEETS, objects=THREE | {INTRUDER: (2.0, 1e9)}, identities=names)
    assert (INTRUDER in task_of(play(think, script, 8.0)).unexplained) is unexplained

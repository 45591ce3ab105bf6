"""Order that is meant: a stage is done by what happens in it, unless it says `already`."""

from __future__ import annotations

from dataclasses import replace
from itertools import permutations

import pytest

from tests.rules.predicates.test_certainty import mind_of
from tests.tasks.scripted import RelationSpan, Script, ScriptedRun, play, task_of
from visup.agent import Relation, Status, Truth, Verdict
from visup.tasks import parse_task
from visup.tasks.supervision.supervise import finish, task_reasoner
from visup.tasks.verification.observe import RelationLookup

TOP, LEGS = 1, (2, 3, 4)
NAMES = {TOP: {"top": 0.9}, **{k: {f"leg_{n}": 0.9} for n, k in enumerate(LEGS, 1)}}
PRESENT = dict.fromkeys(NAMES, (0.0, 1e9))
TWO = "<t> ::= <a> <b>\n<a> ::= touching(leg_1, top)\n<b> ::= {}touching(leg_2, top)"


def scene(*meetings: tuple[int, float]) -> Script:
    """Legs that meet the top, each from a time on; `(3, 5.0)`: the second leg from 5 s."""
    spans = tuple(RelationSpan("touching", since, 1e9, (TOP, leg)) for leg, since in meetings)
    return Script(spans, objects=PRESENT, identities=NAMES)


def watched(text: str, script: Script, until: float = 30.0) -> ScriptedRun:
    return play(task_reasoner([parse_task(text)]), script, until)


def verdict(text: str, script: Script, until: float = 30.0) -> Verdict:
    return finish(task_of(watched(text, script, until)))


def test_assembly_in_the_required_order_succeeds() -> None:
    assert verdict(TWO.format(""), scene((2, 3.0), (3, 8.0))) is Verdict.SUCCEEDED


@pytest.mark.parametrize("since", [0.0, 2.0, 6.0])
def test_an_action_that_held_before_its_stage_does_not_complete_it(since: float) -> None:
    played = watched(TWO.format(""), scene((2, 10.0), (3, since)))
    assert finish(task_of(played)) is Verdict.FAILED
    (stage_b,) = (s for s in task_of(played).stages if s.stage == "b")
    assert stage_b.status in (Status.FAILING, Status.FAILED)
    assert any("before stage `b` began" in e.text for e in played.events)


THREE = (
    "<t> ::= <a> <b> <c>\n<a> ::= touching(leg_1, top)\n<b> ::= {}touching(leg_2, top)\n"
    "<c> ::= {}touching(leg_3, top)"
)


def early_failures(played: ScriptedRun, since: float) -> list[str]:
    """The stages that are told to fail within 4 s since a later one was done."""
    events = (e for e in played.events if e.kind == "stage_failing" and e.time < since + 4.0)
    return [str(e.data["stage"]) for e in events if "before the turn of" in e.text]


def test_a_step_out_of_order_is_reported_at_once() -> None:
    played = watched(THREE.format("", ""), scene((4, 4.0)), 12.0)
    assert early_failures(played, 4.0) == ["a"]
    assert finish(task_of(played)) is Verdict.FAILED
    (text,) = (e.text for e in played.events if e.kind == "stage_failing")
    assert "`c`" in text
    assert "stage `a` must be done first" in text


@pytest.mark.parametrize(
    ("extra", "present"),
    [
        (("", "already "), PRESENT),  # it may have been so before
        (
            ("", ""),
            {k: v for k, v in PRESENT.items() if k != LEGS[0]},
        ),  # nobody knows about the first
    ],
)
def test_uncertain_steps_are_not_reported_as_out_of_order(
    extra: tuple[str, str], present: dict[int, tuple[float, float]]
) -> None:
    script = replace(scene((4, 4.0)), objects=present)
    assert early_failures(watched(THREE.format(*extra), script, 12.0), 4.0) == []


@pytest.mark.parametrize(("until", "reported"), [(5.5, False), (8.0, True)])
def test_an_early_step_that_is_undone_can_be_repeated_in_its_turn(
    until: float, reported: bool
) -> None:
    spans = (
        RelationSpan("touching", 4.0, until, (TOP, 4)),
        RelationSpan("touching", 10.0, 1e9, (TOP, 2)),
        RelationSpan("touching", 14.0, 1e9, (TOP, 3)),
        RelationSpan("touching", 18.0, 1e9, (TOP, 4)),
    )
    played = watched(THREE.format("", ""), Script(spans, objects=PRESENT, identities=NAMES))
    assert bool(early_failures(played, 4.0)) is reported
    assert finish(task_of(played)) is Verdict.SUCCEEDED


def test_an_early_step_that_is_not_undone_stays_out_of_order() -> None:
    played = watched(THREE.format("", ""), scene((4, 4.0), (2, 10.0), (3, 14.0)))
    assert finish(task_of(played)) is Verdict.FAILED
    assert early_failures(played, 4.0) == ["a"]
    # Nor does it help that what was lacking is done by and by.
    before = watched(THREE.format("", ""), scene((4, 4.0), (2, 10.0), (3, 14.0)), 16.0)
    assert finish(task_of(before)) is Verdict.FAILED
    assert not any(e.kind == "stage_done" for e in before.events)


@pytest.mark.parametrize(
    ("last", "spans"),
    [
        # It is so before anything is done.
        ("apart(leg_3, top)", (RelationSpan("touching", 0.0, 4.0, (TOP, 4)),)),
        # What the first stage has left behind goes on.
        ("coupled(leg_1, top)", (RelationSpan("coupled", 6.0, 1e9, (TOP, 2)),)),
    ],
)
def test_initial_states_and_continuing_actions_are_not_out_of_order(
    last: str, spans: tuple[RelationSpan, ...]
) -> None:
    text = THREE.format("", "").replace("touching(leg_3, top)", last)
    spans += (RelationSpan("touching", 2.0, 1e9, (TOP, 2)),) if "coupled" in last else ()
    played = watched(text, Script(spans, objects=PRESENT, identities=NAMES), 12.0)
    assert not any("before the turn of" in e.text for e in played.events)


def test_a_relation_that_held_from_the_start_is_not_out_of_order() -> None:
    assert early_failures(watched(THREE.format("", ""), scene((4, 0.0)), 12.0), 0.0) == []


@pytest.mark.parametrize("since", [0.0, 2.0, 6.0])
def test_already_accepts_an_action_that_held_before(since: float) -> None:
    assert verdict(TWO.format("already "), scene((2, 10.0), (3, since))) is Verdict.SUCCEEDED


def test_a_relation_that_ends_and_holds_again_completes_its_stage() -> None:
    spans = (
        RelationSpan("touching", 10.0, 1e9, (TOP, 2)),
        RelationSpan("touching", 2.0, 12.0, (TOP, 3)),
        RelationSpan("touching", 18.0, 1e9, (TOP, 3)),
    )
    assert (
        verdict(TWO.format(""), Script(spans, objects=PRESENT, identities=NAMES))
        is Verdict.SUCCEEDED
    )


@pytest.mark.parametrize("order", list(permutations(LEGS)))
def test_every_order_of_three_stages_succeeds(order: tuple[int, ...]) -> None:
    text = "<t> ::= any order (<a>, <b>, <c>)\n" + "\n".join(
        f"<{n}> ::= touching(leg_{k}, top)" for k, n in enumerate("abc", 1)
    )
    meetings = [(leg, 4.0 + 5.0 * k) for k, leg in enumerate(order)]
    played = watched(text, scene(*meetings))
    assert finish(task_of(played)) is Verdict.SUCCEEDED
    # What is finished is told as soon as the next begins, whichever that is.
    done = {s.stage for s in task_of(played, 13.5).stages if s.status is Status.DONE}
    assert len(done) >= 2


@pytest.mark.parametrize(
    ("legs", "expected"),
    [((2, 3), Verdict.SUCCEEDED), ((4, 2), Verdict.SUCCEEDED), ((3,), Verdict.IN_PROGRESS)],
)
def test_any_two_of_three_contacts_suffice(legs: tuple[int, ...], expected: Verdict) -> None:
    text = "<t> ::= any 2 of (touching(leg_1, top), touching(leg_2, top), touching(leg_3, top))"
    assert verdict(text, scene(*((leg, 4.0 + 5.0 * k) for k, leg in enumerate(legs)))) is expected


def test_a_stage_with_an_actor_as_parameter_is_one_stage_for_each() -> None:
    text = (
        "<t> ::= for each leg of (leg_1, leg_2, leg_3) <mount(leg)>\n"
        "<mount(leg)> ::= touching(leg, top)"
    )
    played = watched(text, scene((3, 4.0), (2, 9.0), (4, 14.0)))
    assert finish(task_of(played)) is Verdict.SUCCEEDED
    names = {s.stage for s in task_of(played).stages}
    assert names == {"mount(leg_1)", "mount(leg_2)", "mount(leg_3)"}


def test_a_declared_recovery_follows_a_failure() -> None:
    text = (
        "<t> ::= <reach> <grasp>\n<reach> ::= converging(leg_1, top)\n"
        "<grasp> ::= touching(leg_1, top)\n"
        "on failure of <grasp>: diverging(leg_1, top) converging(leg_1, top) <grasp>"
    )
    pair = (TOP, 2)
    spans = (
        RelationSpan("converging", 1.0, 5.0, pair),
        RelationSpan("diverging", 5.0, 10.0, pair),
        RelationSpan("converging", 10.0, 14.0, pair),
        RelationSpan("touching", 14.0, 1e9, pair),
    )
    script = Script(spans, objects=PRESENT, identities=NAMES)
    assert verdict(text, script) is Verdict.SUCCEEDED


@pytest.mark.parametrize(
    ("shift", "stands"), [((0, -60), True), ((0, 60), False), ((300, -60), False)]
)
def test_an_object_that_touches_another_from_above_is_on_it(
    shift: tuple[int, int], stands: bool
) -> None:
    mind = mind_of((200, 300, 120, 60), (230 + shift[0], 300 + shift[1], 60, 60))
    touching = Relation("touching", (1, 2), Truth.TRUE, 0.0)
    mind = replace(mind, relations=(touching,))
    truth = RelationLookup(mind).find("on", (2, 1)).truth
    assert truth is (Truth.TRUE if stands else Truth.FALSE)


@pytest.mark.parametrize("met", [True, False])
def test_closing_fingers_do_not_fail_an_approach_after_contact(met: bool) -> None:
    text = "<t> ::= <near> <off>\n<near> ::= converging(leg_1, top)\n<off> ::= gone(leg_1)"
    pair = (TOP, 2)
    spans = [RelationSpan("converging", 1.0, 5.0, pair), RelationSpan("diverging", 5.5, 7.0, pair)]
    if met:
        spans += [RelationSpan(n, 5.0, 1e9, pair) for n in ("touching", "in_contact")]
    played = watched(text, Script(tuple(spans), objects=PRESENT, identities=NAMES), 7.0)
    failing = [e for e in played.events if e.kind == "stage_failing" and "`near`" in e.text]
    assert bool(failing) is not met


UNDO = (
    "<t> ::= <lift> <change> <down>\n<lift> ::= coupled(leg_1, top)\n"
    "<change> ::= touching(leg_2, top)\n<down> ::= decoupled(leg_1, top)"
)


@pytest.mark.parametrize(("until", "expected"), [(16.0, True), (6.0, False), (4.0, False)])
def test_a_step_that_undoes_an_earlier_stage_has_its_own_turn(until: float, expected: bool) -> None:
    """Let down before the wheel is changed: the order is not that of the task."""
    spans = (
        RelationSpan("coupled", 2.0, until, (TOP, 2)),
        RelationSpan("touching", 10.0, 1e9, (TOP, 3)),
    )
    script = Script(spans, objects=PRESENT, identities=NAMES)
    assert (verdict(UNDO, script) is Verdict.SUCCEEDED) is expected


BOTH = (
    "<t> ::= <a> <b> <c>\n<a> ::= touching(leg_1, top)\n"
    "<b> ::= touching(leg_2, top) & touching(leg_3, top)\n<c> ::= apart(leg_1, top)"
)


@pytest.mark.parametrize(("until", "expected"), [(8.0, False), (14.0, True)])
def test_actions_joined_by_and_must_hold_at_the_same_time(until: float, expected: bool) -> None:
    spans = (
        RelationSpan("touching", 2.0, 18.0, (TOP, 2)),
        RelationSpan("touching", 5.0, until, (TOP, 3)),
        RelationSpan("touching", 12.0, 16.0, (TOP, 4)),
    )
    played = watched(BOTH, Script(spans, objects=PRESENT, identities=NAMES), 40.0)
    assert (finish(task_of(played)) is Verdict.SUCCEEDED) is expected
    assert expected is not any("not while what is joined" in e.text for e in played.events)


LONG = (
    "<t> ::= <a> <b>\n<a> ::= touching(leg_1, top)\n"
    "<b> ::= (touching(leg_2, top) & touching(leg_3, top)) for 4 s"
)


@pytest.mark.parametrize(
    ("first", "second", "expected"),
    [
        ((5.0, 14.0), (8.0, 20.0), True),
        ((5.0, 10.0), (8.0, 20.0), False),  # together for 2 s only
        ((5.0, 11.0), (12.0, 20.0), False),  # one after the other, with little between them
    ],
)
def test_a_for_around_actions_counts_while_all_of_them_hold(
    first: tuple[float, float], second: tuple[float, float], expected: bool
) -> None:
    spans = (
        RelationSpan("touching", 2.0, 1e9, (TOP, 2)),
        RelationSpan("touching", *first, (TOP, 3)),
        RelationSpan("touching", *second, (TOP, 4)),
    )
    script = Script(spans, objects=PRESENT, identities=NAMES)
    assert (verdict(LONG, script, 30.0) is Verdict.SUCCEEDED) is expected


def test_a_for_around_actions_tolerates_a_short_interruption() -> None:
    spans = (
        RelationSpan("touching", 2.0, 1e9, (TOP, 2)),
        RelationSpan("touching", 5.0, 1e9, (TOP, 3)),
        RelationSpan("touching", 5.0, 7.0, (TOP, 4)),
        RelationSpan("touching", 7.3, 1e9, (TOP, 4)),
    )
    script = Script(spans, objects=PRESENT, identities=NAMES)
    assert verdict(LONG, script, 30.0) is Verdict.SUCCEEDED


def test_continuing_actions_do_not_excuse_an_early_step() -> None:
    """A table that is stood up before its last leg is on, though the legs are required as well."""
    text = (
        "<t> ::= <a> <b> <stand>\n<a> ::= touching(leg_1, top)\n<b> ::= touching(leg_2, top)\n"
        "<stand> ::= touching(leg_3, top) & touching(leg_1, top) & touching(leg_2, top)"
    )
    assert verdict(text, scene((2, 3.0), (3, 8.0), (4, 13.0))) is Verdict.SUCCEEDED
    assert verdict(text, scene((2, 3.0), (4, 8.0), (3, 13.0))) is Verdict.FAILED


def test_stages_joined_by_and_run_concurrently() -> None:
    text = (
        "<t> ::= (<p> & <q>) <e>\n<p> ::= touching(leg_1, top) apart(leg_1, top)\n"
        "<q> ::= touching(leg_2, top) apart(leg_2, top)\n<e> ::= touching(leg_3, top)"
    )
    for first, second in (((2.0, 9.0), (5.0, 12.0)), ((2.0, 5.0), (9.0, 12.0))):
        spans = (
            RelationSpan("touching", *first, (TOP, 2)),
            RelationSpan("touching", *second, (TOP, 3)),
            RelationSpan("touching", 16.0, 1e9, (TOP, 4)),
        )
        script = Script(spans, objects=PRESENT, identities=NAMES)
        assert verdict(text, script) is Verdict.SUCCEEDED


@pytest.mark.parametrize("lasts", [0.5, 2.0])
def test_the_stage_after_eight_contacts_in_any_order_is_reached(lasts: float) -> None:
    """A touch counts against the courses without it from its 0.4th second on, however times are rounded."""
    order = (9, 6, 4, 2, 8, 3, 5, 7)
    names = {TOP: {"top": 0.9}, **{k: {f"leg_{k - 1}": 0.9} for k in range(2, 11)}}
    text = "<t> ::= any order (" + ", ".join(f"<s{k}>" for k in sorted(order)) + ") <c>\n"
    text += "\n".join(f"<s{k}> ::= touching(leg_{k - 1}, top)" for k in order)
    text += "\n<c> ::= touching(leg_9, top)"
    meetings = [(leg, 2.0 + 2 * k, 2.0 + 2 * k + lasts) for k, leg in enumerate(order)]
    meetings.append((10, 20.0, 1e9))
    spans = tuple(
        RelationSpan("touching", since, until, (TOP, leg)) for leg, since, until in meetings
    )
    script = Script(spans, objects=dict.fromkeys(names, (0.0, 1e9)), identities=names)
    played = play(task_reasoner([parse_task(text)]), script, 24.0, fps=10.0)
    assert finish(task_of(played)) is Verdict.SUCCEEDED

"""Rules at work: groundings, time, unknowns, what tasks expect; sentences."""

from collections.abc import Iterator
from dataclasses import replace
from types import MappingProxyType

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.rules.runs import Thought, reason, think
from tests.rules.scenes import box_region, seen
from visup.agent import (
    Binding,
    Candidate,
    Expectation,
    HealthStatus,
    Mind,
    ObjectBelief,
    Observation,
    Outcome,
    Presence,
    Reasoner,
    ReportState,
    Severity,
    TaskBelief,
    Truth,
    Verdict,
)
from visup.rules.language.parser import parse_rules
from visup.rules.reasoners import default_reasoners
from visup.rules.safety.reasoner import RuleReasoner
from visup.rules.wording.sentences import describe, sentence

NAMES = {1: [("probe", 0.9)], 2: [("arm_model", 0.9)], 3: [("dish", 0.9)]}


def task(expected: tuple[Expectation, ...] = (), unexplained: tuple[int, ...] = ()) -> Reasoner:
    def put(mind: Mind, observation: Observation) -> Outcome:
        bindings = (
            Binding("satellite", ("probe",), 1, 0.9),
            Binding("arm", ("arm_model",), 2, 0.9),
        )
        belief = TaskBelief(
            "dock",
            Verdict.IN_PROGRESS,
            bindings=bindings,
            expected=expected,
            unexplained=unexplained,
        )
        return Outcome(replace(mind, tasks=(belief,)))

    return put


def raised(thoughts: list[Thought]) -> set[tuple[str, frozenset[int]]]:
    return {(c.kind, frozenset(c.objects)) for t in thoughts for c in t.conditions}


def closing(seconds: float = 5.0, speed: float = 20.0) -> Iterator[Observation]:
    for i in range(round(25 * seconds)):
        boxes = [
            box_region(1, (100, 200, 80, 60)),
            box_region(2, (420 - speed * i / 25, 200, 80, 60)),
        ]
        yield seen(i, boxes, names=NAMES)


def test_rules_that_serve_two_agents_by_turns_tell_each_what_they_tell_it_alone() -> None:
    """What is not worked out again is what would come out again, whoever asked before."""
    rules = default_reasoners()
    shared = (*rules.update, *rules.cogitate)
    scripts = [list(closing()), list(closing(speed=35.0)), [seen(i, []) for i in range(125)]]
    together = [think(shared, s) for s in scripts]
    by_turns = list(zip(*together, strict=True))
    for k, script in enumerate(scripts):
        alone = reason(script)
        assert [t[k].conditions for t in by_turns] == [t.conditions for t in alone]


def test_closing_in_is_a_collision_course_where_no_task_wants_it() -> None:
    thoughts = reason(closing())
    assert raised(thoughts) == {("collision_course", frozenset({1, 2}))}
    concern = thoughts[-1].conditions[0]
    assert concern.objects == (2, 1)
    assert concern.severity is Severity.WARNING
    assert concern.cause == (
        "Object 2, believed to be the arm model, appears to be on a collision course with "
        "object 1, believed to be the probe."
    )
    assert any("time_to_contact(the arm model, the probe)" in e for e in concern.evidence)


@pytest.mark.parametrize("relation", ["converging", "touching", "coupled"])
def test_a_task_that_expects_it_suspends_collision_course(relation: str) -> None:
    assert not raised(reason(closing(), task((Expectation(relation, (2, 1)),))))


def test_what_a_task_has_just_asked_for_is_no_danger_before_a_body_can_brake() -> None:
    """The next stage begins while the body still comes on, as a drone does that is to keep its distance."""
    wanted = (Expectation("converging", (2, 1)),)

    def put(mind: Mind, observation: Observation) -> Outcome:
        return task(wanted if observation.time < 3.0 else ())(mind, observation)

    at = {t.mind.time for t in reason(closing(7.0), put) if t.conditions}
    assert 5.0 <= min(at) < 6.5


def test_what_the_task_expects_of_others_does_not_suspend_it() -> None:
    found = raised(reason(closing(), task((Expectation("converging", (2, 3)),))))
    assert ("collision_course", frozenset({1, 2})) in found


def test_bodies_at_different_depths_pass_each_other() -> None:
    far = {1: ("probe", 10.0), 2: ("arm_model", 16.0)}
    observations = (seen(o.frame_index, o.of("region"), names=NAMES, depths=far) for o in closing())
    assert not raised(reason(observations))


@pytest.mark.parametrize(("across", "threatens"), [(0.0, True), (0.8, True), (3.6, False)])
def test_who_moves_mostly_across_is_on_no_collision_course(across: float, threatens: bool) -> None:
    """It comes nearer to a long wall by 20 pixels per second, and goes along it."""

    def at(i: int) -> Observation:
        wall, body = (60, 60, 520, 40), (80 + across * i, 330 - 0.8 * i, 40, 40)
        return seen(i, [box_region(1, wall), box_region(2, body)], names=NAMES)

    found = raised(reason(at(i) for i in range(125)))
    assert (("collision_course", frozenset({1, 2})) in found) is threatens


def test_a_body_threatens_what_it_meets_first_and_not_what_stands_behind() -> None:
    observations = (
        seen(o.frame_index, [*o.of("region"), box_region(3, (10, 200, 60, 60))], names=NAMES)
        for o in closing()
    )
    assert raised(reason(observations)) == {("collision_course", frozenset({1, 2}))}


def test_still_objects_raise_nothing() -> None:
    assert not raised(reason(closing(speed=0.0)))


def test_without_a_task_nothing_is_unexpected_with_one_what_it_does_not_explain_is() -> None:
    still = list(closing(speed=0.0))
    assert not raised(reason(still))
    assert not raised(reason(still, task()))
    assert raised(reason(still, task(unexplained=(2,)))) == {("unexpected_object", frozenset({2}))}


def test_an_actor_that_is_lost_is_missed_and_one_that_is_hidden_is_not() -> None:
    def at(i: int) -> Observation:
        regions = [box_region(1, (100, 200, 80, 60))] if i < 60 else []
        return seen(i, [*regions, box_region(2, (400, 200, 80, 60))], names=NAMES)

    found = raised(reason((at(i) for i in range(250)), task()))
    assert found == {("loss_of_object", frozenset({1}))}


@pytest.mark.parametrize("kind", [{"state": ReportState.FAILED}, {"health": HealthStatus.BLOCKED}])
def test_perception_that_cannot_be_trusted_is_told(kind: dict[str, ReportState]) -> None:
    boxes = [box_region(1, (100, 200, 80, 60))]
    good = [seen(i, boxes) for i in range(50)]
    bad = [seen(i, boxes, **kind) for i in range(50, 100)]  # type: ignore[arg-type]
    thoughts = reason([*good, *bad])
    assert not raised(thoughts[:74])
    assert raised(thoughts) == {("stale_perception", frozenset())}


def test_a_concern_ends_with_its_cause_after_the_hold() -> None:
    stops = (o for o in closing(3.0))
    last = list(closing(3.0))[-1].of("region")
    still = (seen(i, last, names=NAMES) for i in range(75, 250))
    thoughts = reason([*stops, *still])
    until = max(t.mind.time for t in thoughts if t.conditions)
    assert 4.0 < until < 8.0


# `for` against a dumb twin that looks at the whole history.

WHEN = parse_rules(
    'rule held(a): info when named(a, probe) for 0.3 s say "{a}"\n'
    'rule not_held(a): info when not (named(a, probe) for 0.3 s) say "{a}"'
)
NAMED = {Truth.TRUE: "probe", Truth.FALSE: "dish", Truth.UNKNOWN: None}


def by_history(values: list[Truth]) -> Truth:
    """False if false in the last 0.3 s, true if true in all of it; before the first sample unknown."""
    tail = values[-4:]
    if Truth.FALSE in tail:
        return Truth.FALSE
    return Truth.TRUE if len(tail) == 4 and set(tail) == {Truth.TRUE} else Truth.UNKNOWN


@settings(max_examples=80, deadline=None)
@given(st.lists(st.sampled_from(list(Truth)), min_size=1, max_size=25))
def test_for_is_what_history_says(values: list[Truth]) -> None:
    reasoner, mind = RuleReasoner(WHEN), Mind()
    for i, value in enumerate(values):
        mind = replace(mind, time=i * 0.1).with_objects(believed(1, NAMED[value]))
        outcome = reasoner(mind, Observation(i, i * 0.1, (640, 480)))
        mind = outcome.mind
        kinds = {c.kind for c in outcome.conditions}
        told = {Truth.TRUE: {"held"}, Truth.FALSE: {"not_held"}, Truth.UNKNOWN: set()}
        assert kinds == told[by_history(values[: i + 1])]


def test_unknown_raises_no_concern_and_suspends_none() -> None:
    rules = parse_rules(
        'rule far(a, b): info when depth_difference(a, b) > 1 % say "{a} {b}"\n'
        'rule near(a, b): info when not depth_difference(a, b) > 1 % say "{a} {b}"\n'
        'rule there(a, b): info when seen(a) unless depth_difference(a, b) > 1 % say "{a} {b}"\n'
    )
    base = default_reasoners(rules=rules)
    observations = list(closing(1.0, 0.0))
    thoughts = list(think((*base.update, *base.cogitate), observations))
    assert {c.kind for c in thoughts[-1].conditions} == {"there"}


def believed(id_: int, name: str | None) -> ObjectBelief:
    region = box_region(id_, (50 * id_, 50, 30, 30))
    assert region is not None
    named = (Candidate(name, 3.0, 0.9, 0.9),) if name else ()
    return ObjectBelief(id_, region, Presence.SEEN, 0.0, 1.0, True, named)


MIND = Mind(actors=MappingProxyType({"satellite": ("spartan",)})).with_objects(
    believed(1, "spartan"), believed(2, "rms_arm"), believed(3, None)
)


@pytest.mark.parametrize(
    ("template", "ids", "confidence", "expected"),
    [
        (
            "{0} {is} on a collision course with {1}.", (1, 2), 0.8,
            "Object 1, believed to be the satellite, appears to be on a collision course with "
            "object 2, believed to be the rms arm.",
        ),
        ("{0} {is} near {1}.", (3, 1), 0.99,
         "Object 3 is near object 1, believed to be the satellite."),
        ("{0} {is} near {1}.", (1, 3), 0.2,
         "Object 1, believed to be the satellite, may be near object 3."),
        ("{0} leaves.", (2,), 1.0, "Object 2, believed to be the rms arm, leaves."),
        ("{0} meets {1}; {1} stops.", (1, 2), 1.0,
         "Object 1, believed to be the satellite, meets object 2, believed to be the rms arm; "
         "the rms arm stops."),
        ("{0} comes; {0} goes.", (3,), 1.0, "Object 3 comes; it goes."),
    ],
)  # fmt: skip
def test_sentences(template: str, ids: tuple[int, ...], confidence: float, expected: str) -> None:
    assert sentence(MIND, template, *ids, confidence=confidence) == expected


def test_an_object_is_called_by_its_actor_then_by_its_model() -> None:
    bound = replace(
        MIND,
        tasks=(
            TaskBelief("t", Verdict.IN_PROGRESS, bindings=(Binding("gripper", ("rms_arm",), 2),)),
        ),
    )
    assert describe(MIND, 2) == "object 2, believed to be the rms arm"
    assert describe(bound, 2) == "object 2, believed to be the gripper"
    assert describe(MIND, 3) == "object 3"


@pytest.mark.parametrize("object_id", [1, 2, 3])
def test_who_is_cast_by_a_task_and_looks_otherwise_is_not_believed_to_be_that(
    object_id: int,
) -> None:
    cast = TaskBelief("t", Verdict.IN_PROGRESS, bindings=(Binding("lid", ("lid",), object_id),))
    told = sentence(replace(MIND, tasks=(cast,)), "{0} {is} near {1}.", object_id, 9)
    assert told.startswith(f"Object {object_id}, in the part of the lid, ")

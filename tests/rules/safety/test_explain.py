"""Why a verdict is what it is; minds that were kept can be asked, and judged on from, as ever."""

import re
from collections.abc import Iterator
from dataclasses import replace
from itertools import product
from pathlib import Path

import pytest
from typer.testing import CliRunner

from tests.oracles.reasoning.rule_scenes import minds, twenty_rules
from tests.rules.runs import Thought, reason
from tests.rules.safety.test_reasoner import NAMES, believed
from tests.rules.scenes import box_region, seen
from visup.agent import Binding, Expectation, Mind, Observation, Outcome, TaskBelief, Verdict
from visup.agent.model.errors import RuleError
from visup.agent.model.mind import Zone
from visup.agent.model.object_beliefs import Pose, Spin
from visup.cli import app
from visup.rules.language.parser import parse_rules, shipped_rules
from visup.rules.predicates.snapshot import Snapshot
from visup.rules.predicates.vocabulary import RULES
from visup.rules.relations.zones import ZoneReasoner
from visup.rules.safety.explain import RuleExplanation
from visup.rules.safety.queries import evaluation_of, explain, object_choices
from visup.rules.safety.reasoner import SAFETY, RuleReasoner

NOTHING = Observation(0, 0.0, (640, 480))


def closing(frames: int) -> Iterator[Observation]:
    for i in range(frames):
        boxes = [
            box_region(1, (100, 200, 80, 60)),
            box_region(2, (420 - 20 * i / 25, 200, 80, 60)),
        ]
        yield seen(i, boxes, names=NAMES)


def watched(frames: int = 125) -> list[Thought]:
    return reason(closing(frames))


def test_a_verdict_is_explained_down_to_its_facts() -> None:
    mind = watched()[-1].mind
    told = explain(mind, "collision_course", 2, 1)
    assert told.verdict is not None
    assert told.verdict.value == "true"
    text = str(told)
    assert text.startswith("collision_course(the arm model, the probe) is true")
    assert "  when (" in text
    assert "converging(the arm model, the probe) is true\n" in text
    assert "time_to_contact(the arm model, the probe) < 20 s is true, by" in text
    told_s = r"time_to_contact\(the arm model, the probe\) = ([\d.]+) to ([\d.]+) s"
    ((soonest, latest),) = re.findall(told_s, text)
    assert float(soonest) - 0.1 <= 140.8 / 20 <= float(latest)
    assert "  unless " in text
    assert "depth_difference(the arm model, the probe) = unknown" in text
    assert explain(mind, "collision_course", 1, 2).verdict is not told.verdict


def nodes(one: RuleExplanation) -> Iterator[RuleExplanation]:
    yield one
    for part in one.parts:
        yield from nodes(part)


def test_explanations_agree_with_what_was_told_whatever_the_rule() -> None:
    reasoner, memory = RuleReasoner(twenty_rules()), None
    for mind in minds(3, 60):
        mind = mind if memory is None else mind.remember(SAFETY, memory)
        outcome = reasoner(mind, NOTHING)
        memory = outcome.mind.recall(SAFETY)
    values = evaluation_of(outcome.mind)
    raised = {(rule.name, ids) for rule, ids in values.true_bindings()}
    for rule in values.compiled.rules:
        for ids in object_choices(values, rule):
            told = explain(outcome.mind, rule.name, *ids)
            assert (told.verdict == "true") == ((rule.name, ids) in raised)
            assert all(low <= high for low, high in (n.interval for n in nodes(told)))


def test_an_older_mind_goes_on_as_if_no_newer_one_had_been_made() -> None:
    reasoner = RuleReasoner(twenty_rules())
    seen_minds = list(minds(4, 90))

    def run(mind: Mind | None, rest: list[Mind]) -> list[tuple[object, ...]]:
        told: list[tuple[object, ...]] = []
        for new in rest:
            if mind is not None:
                new = new.remember(SAFETY, mind.recall(SAFETY))
            outcome = reasoner(new, NOTHING)
            mind = outcome.mind
            told.append(outcome.conditions)
        return told

    kept: list[Mind] = []
    mind = None
    for new in seen_minds:
        new = new if mind is None else new.remember(SAFETY, mind.recall(SAFETY))
        mind = reasoner(new, NOTHING).mind
        kept.append(mind)
    straight = run(None, seen_minds)
    for fork in (20, 45, 70):
        assert run(kept[fork], seen_minds[fork + 1 :]) == straight[fork + 1 :]


def test_what_was_never_judged_cannot_be_explained() -> None:
    mind = watched(30)[-1].mind
    with pytest.raises(RuleError, match="no rules have been evaluated"):
        explain(Mind(), "collision_course", 1, 2)
    with pytest.raises(RuleError, match="did you mean 'contact'"):
        explain(mind, "contac", 1, 2)
    with pytest.raises(RuleError, match="about 2 object"):
        explain(mind, "contact", 1)
    with pytest.raises(RuleError, match="no object 7 in view"):
        explain(mind, "contact", 1, 7)
    with pytest.raises(RuleError, match="distinct objects"):
        explain(mind, "contact", 1, 1)


def concerns(text: str, mind: Mind) -> set[tuple[str, tuple[int, ...]]]:
    outcome = RuleReasoner(parse_rules(text))(mind, NOTHING)
    return {(c.kind, c.objects) for c in outcome.conditions}


MIND = Mind(time=1.0, frame_size=(640, 480)).with_objects(
    believed(1, "probe"), believed(2, "arm"), believed(3, "dish")
)


def test_objects_are_distinct_unless_they_may_repeat() -> None:
    pairs = {(a, b) for a, b in product((1, 2, 3), repeat=2)}
    rule = 'rule r({}): info when seen(a) and seen(b) say "{{a}} {{b}}"'
    both = values_for(rule.format("a, b"))
    assert both == {p for p in pairs if p[0] != p[1]}
    assert values_for(rule.format("a, b may repeat")) == pairs


def values_for(text: str) -> set[tuple[int, ...]]:
    rules = parse_rules(text)
    outcome = RuleReasoner(rules)(MIND, NOTHING)
    return {ids for _, ids in evaluation_of(outcome.mind).true_bindings()}


@pytest.mark.parametrize(
    ("when", "expected"),
    [
        ("exists b: named(b, probe)", {2, 3}),
        ("exists b may repeat: named(b, probe)", {1, 2, 3}),
        ("forall b: not named(b, probe)", {1}),
        ("forall b may repeat: not named(b, probe)", set()),
        ("named(a, arm) and exists b: exists c: (named(b, dish) and named(c, probe))", {2}),
        ("named(a, arm) and exists b: exists c: (named(b, arm) and named(c, probe))", set()),
    ],
)
def test_quantifiers(when: str, expected: set[int]) -> None:
    text = f'rule r(a): info when seen(a) and {when} say "{{a}}"'
    assert {ids[0] for ids in values_for(text)} == expected


def test_a_rule_without_objects_and_a_mind_without_objects() -> None:
    assert concerns('rule r(): info when healthy() say "well"', Mind(time=1.0)) == {("r", ())}
    assert not concerns('rule r(): info when exists a: seen(a) say "x"', Mind(time=1.0))
    assert concerns('rule r(): info when forall a: seen(a) say "x"', Mind(time=1.0)) == {("r", ())}


def test_cooldown_keeps_a_rule_quiet_after_its_concern_was_over() -> None:
    rules = parse_rules('rule r(a): info when named(a, probe) cooldown 1 s say "{a}"')
    reasoner, mind, told = RuleReasoner(rules), Mind(), []
    for k in range(30):
        name = "probe" if k in (2, 5, 6, 15) else "dish"
        mind = replace(mind, time=k * 0.1).with_objects(believed(1, name))
        outcome = reasoner(mind, NOTHING)
        mind = outcome.mind
        told += [k] if outcome.conditions else []
    assert told == [2, 15]


SQUARE = ((100.0, 0.0), (300.0, 0.0), (300.0, 200.0), (100.0, 200.0))


@pytest.mark.parametrize(
    ("zone", "depth", "expected"),
    [
        (Zone("keep_out_bay", SQUARE), None, {2, 3}),
        (Zone("bay", SQUARE), None, set()),
        (Zone("keep_out", SQUARE, (5.0, 10.0)), 7.0, {2, 3}),
        (Zone("keep_out", SQUARE, (5.0, 10.0)), 10.1, set()),
        (Zone("keep_out", SQUARE, (5.0, 10.0)), None, set()),
    ],
)
def test_forbidden_zones_are_those_named_so_and_depth_must_be_known(
    zone: Zone, depth: float | None, expected: set[int]
) -> None:
    objects = [replace(b, depth=depth, depth_sigma=0.2) for b in MIND.objects.values()]
    mind = replace(MIND, zones=(zone,)).with_objects(*objects)
    for k in range(10):
        seen = [replace(b, last_seen=k * 0.1) for b in mind.objects.values()]
        mind = ZoneReasoner()(replace(mind, time=k * 0.1).with_objects(*seen), NOTHING).mind
    text = 'rule r(a): info when in_forbidden_zone(a) say "{a}"'
    assert {o[0] for _, o in concerns(text, mind)} == expected


def test_a_zone_that_is_not_drawn_is_unknown() -> None:
    for when in ("inside(a, bay)", "not inside(a, bay)"):
        assert not concerns(f'rule r(a): info when {when} say "{{a}}"', MIND)


def spinning(rate: float, sigma: float, expectations: tuple[Expectation, ...] = ()) -> set[str]:
    reasoner, told, mind = RuleReasoner(shipped_rules()), set[str](), MIND
    for k in range(60):
        spin = Pose(
            "probe",
            0,
            (0.0, 0.0, 1.0),
            None,
            0.0,
            spin=Spin(rate, sigma, (0.0, 1.0, 0.0)),
        )
        task = TaskBelief("t", Verdict.IN_PROGRESS, expected=expectations)
        mind = replace(mind, time=1.0 + k / 25, tasks=(task,))
        mind = mind.with_objects(replace(mind.objects[1], pose=spin))
        outcome: Outcome = reasoner(mind, NOTHING)
        mind, told = outcome.mind, told | {c.kind for c in outcome.conditions}
    return told


def test_spin_is_excessive_when_it_surely_is_and_sooner_for_what_shall_be_grasped() -> None:
    wanted = (Expectation("coupled", (1, 2)),)
    assert spinning(40.0, 3.0) == {"excessive_spin"}
    assert not spinning(40.0, 15.0)
    assert not spinning(18.0, 1.0)
    assert spinning(18.0, 1.0, wanted) == {"excessive_spin"}
    assert not spinning(4.0, 0.5, wanted)


def touching_at(depths: dict[int, tuple[str, float]], expected: bool) -> set[str]:
    def task(mind: Mind, observation: Observation) -> Outcome:
        bound = (Binding("a", ("probe",), 1, 0.9), Binding("b", ("arm_model",), 2, 0.9))
        wanted = (Expectation("coupled", (1, 2)),) if expected else ()
        belief = TaskBelief("t", Verdict.IN_PROGRESS, bindings=bound, expected=wanted)
        return Outcome(replace(mind, tasks=(belief,)))

    def approach(i: int) -> Observation:
        boxes = [
            box_region(1, (100, 200, 80, 60)),
            box_region(2, (max(180.0, 300 - 40 * i / 25), 200, 80, 60)),
        ]
        return seen(i, boxes, names=NAMES, depths=depths)

    thoughts = reason((approach(i) for i in range(110)), task)
    return {c.kind for t in thoughts for c in t.conditions}


def test_contact_is_told_where_depths_agree_and_no_task_brought_the_two_together() -> None:
    near = {1: ("probe", 10.0), 2: ("arm_model", 10.2)}
    assert "contact" in touching_at(near, expected=False)
    assert "contact" not in touching_at(near, expected=True)
    assert "contact" not in touching_at({}, expected=False)
    assert "contact" not in touching_at({**near, 2: ("arm_model", 14.0)}, expected=False)


def test_facts_of_pairs_stand_in_the_order_of_their_objects() -> None:
    mind = watched()[-1].mind
    facts = Snapshot(mind)
    assert facts.ids == (1, 2)
    assert facts.relation_codes("converging").tolist() == [[-1, 1], [1, -1]]
    soonest, latest = RULES.quantities["time_to_contact"].evaluate(facts)
    assert 0 < soonest[0, 1] == soonest[1, 0] <= latest[0, 1] == latest[1, 0]
    assert facts.first_contact.tolist() == [[0, 1], [1, 0]]


def test_the_command_checks_and_lists_rules(tmp_path: Path) -> None:
    good, bad = tmp_path / "good.rules", tmp_path / "bad.rules"
    good.write_text('rule r(a, b): info when eventually[2 s] gap(a, b) < 3 px say "{a} {b}"\n')
    bad.write_text('rule q(a): info when sen(a) for 2 px say "{a}"\n')
    fine = CliRunner().invoke(app, ["rules", "check", str(good)])
    assert fine.exit_code == 0
    assert "r: reported 2 s late, at most" in fine.output
    wrong = CliRunner().invoke(app, ["rules", "check", str(good), str(bad)])
    assert "'sen'" in str(wrong.exception)
    assert "'for' needs a time" in str(wrong.exception)
    listed = CliRunner().invoke(app, ["rules", "list"])
    assert all(rule.name in listed.output for rule in shipped_rules())
    as_json = CliRunner().invoke(app, ["rules", "list", "--json", str(good)])
    assert '"delay_s": 2.0' in as_json.output

"""Behaviours that sleep: who calls them, who takes over, and who never sleeps."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from visup.agent import Contract, Directive, Frame, Observation, Percept, ReportState
from visup.agent.contract.limits import Limits
from visup.agent.cycle.agent import Agent, Reasoners
from visup.agent.model.errors import BehaviourError
from visup.agent.model.step import Step
from visup.rules.activation.activation import ActivationReasoner, activation_rules, always_active
from visup.rules.language.parser import parse_rules, shipped_rules
from visup.rules.reasoners import default_reasoners
from visup.runs.settings import WatchSettings
from visup.runs.wiring import build_agent
from visup.testing import LabelledFrame, crossing

NEAR = "exists b: gap(a, b) < 30 px"
CLIP = crossing(frames=60)


class Eye:
    """Tells the true regions of a clip."""

    contract = Contract("eye", gives=("region",))

    def __init__(self, shots: Sequence[LabelledFrame] = CLIP) -> None:
        self.shots = shots

    def perceive(
        self, frame: Frame, observation: Observation, directives: Sequence[Directive]
    ) -> Iterable[Percept]:
        return [self.contract.percept(frame, r) for r in self.shots[frame.index].regions]


class Lens:
    """Tells of which regions it was called, or fails from a frame on."""

    def __init__(self, name: str = "lens", fails_from: int = 10**6, **declared: object) -> None:
        self.contract = Contract(name, gives=("detail",), **declared)  # type: ignore[arg-type]
        self.fails_from = fails_from

    def perceive(
        self, frame: Frame, observation: Observation, directives: Sequence[Directive]
    ) -> Iterable[Percept]:
        if frame.index >= self.fails_from:
            raise RuntimeError("the lens broke")
        called = tuple(d.data["region"] for d in directives if d.kind == "wake")
        return [self.contract.percept(frame, {"by": self.contract.name, "called": called})]


def run(*lenses: Lens, wakeful: frozenset[str] = frozenset()) -> list[Step]:
    rules = default_reasoners()
    wake = ActivationReasoner(activation_rules([b.contract for b in lenses]))
    reasoners = Reasoners(rules.update, rules.cogitate, attend=(wake,))
    limits = Limits(hang_s=None, never_asleep=wakeful)
    return list(Agent([Eye(), *lenses], reasoners, limits=limits).steps(s.frame for s in CLIP))


def state(step: Step, name: str) -> ReportState:
    return next(r.state for r in step.reports if r.behaviour == name)


def gap_below(step: Step, least: float) -> bool:
    regions = step.observation.of("region")
    if len(regions) < 2:
        return False
    one, other = sorted(r.bbox for r in regions)
    return bool(other[0] - (one[0] + one[2]) < least)


def test_it_runs_after_steps_in_which_its_condition_held_and_is_told_of_what() -> None:
    steps = run(Lens(awake=NEAR))
    ran = [state(s, "lens") is ReportState.RAN for s in steps]
    assert not ran[0]
    assert any(ran)
    assert not all(ran)
    for before, step in pairwise(steps):
        called = [d for d in before.directives if d.kind == "wake"]
        assert (state(step, "lens") is ReportState.RAN) == bool(called)
        if called:
            (told,) = step.observation.of("detail")
            assert set(told["called"]) == {d.data["region"] for d in called}
            assert all("is called for" in d.reason for d in called)
            assert gap_below(before, 40)


def test_asleep_it_is_not_at_fault_and_nothing_is_unknown() -> None:
    for step in run(Lens(awake=NEAR)):
        assert step.observation.unknown == frozenset()
        assert step.alerts == ()


def test_what_looks_more_closely_takes_over_and_hands_back() -> None:
    coarse, fine = Lens("coarse"), Lens("fine", awake=NEAR, relieves=("coarse",))
    steps = run(coarse, fine)
    told = [tuple(p["by"] for p in s.observation.of("detail")) for s in steps]
    assert set(told) == {("coarse",), ("fine",)}  # never both, never none
    assert told[0] == ("coarse",)
    for step in steps:
        assert step.observation.observed("detail")


def test_where_the_closer_one_fails_the_coarse_one_looks_in_the_same_frame() -> None:
    coarse = Lens("coarse")
    fine = Lens("fine", fails_from=0, awake=NEAR, relieves=("coarse",))
    steps = run(coarse, fine)
    failed = [s for s in steps if state(s, "fine") is ReportState.FAILED]
    assert failed
    for step in steps:
        assert state(step, "coarse") is ReportState.RAN
        assert step.observation.observed("detail")
    assert any(a.kind == "behaviour_failed" for s in failed for a in s.alerts)


def test_one_that_fails_alone_leaves_unknown_what_it_gives_until_it_runs_again() -> None:
    steps = run(Lens(fails_from=0, awake=NEAR))
    first = next(k for k, s in enumerate(steps) if state(s, "lens") is ReportState.FAILED)
    assert all("detail" in s.observation.unknown for s in steps[first:])


def test_who_is_called_by_name_never_sleeps() -> None:
    steps = run(Lens(awake="speed(a) > 1000000 px/s"), wakeful=frozenset({"lens"}))
    assert all(state(s, "lens") is ReportState.RAN for s in steps)


def test_relieving_one_gives_all_that_it_gives() -> None:
    fine = Lens("fine", relieves=("eye",))
    with pytest.raises(BehaviourError, match="relieves 'eye', but does not give 'region'"):
        Agent([Eye(), fine])


def test_two_cannot_relieve_each_other() -> None:
    with pytest.raises(BehaviourError, match="circle"):
        Agent([Lens("one", relieves=("two",)), Lens("two", relieves=("one",))])
    with pytest.raises(BehaviourError, match="relieves"):
        Contract("one", gives=("x",), relieves=("one",))


@pytest.mark.parametrize(
    "condition", ["near(a, b)", "gap(a", "exists b: gap(b, b) < 3 px", "healthy()", "a", "🛰"]
)
def test_what_is_no_condition_about_an_object_is_refused_with_its_place(condition: str) -> None:
    with pytest.raises(BehaviourError) as told:
        activation_rules([Contract("lens", gives=("detail",), awake=condition)])
    assert "contract of 'lens'" in str(told.value)
    with pytest.raises(BehaviourError):
        build_agent(WatchSettings("clip"), extra=[Lens(awake=condition)])


def test_what_safety_rules_read_is_given_by_someone_who_never_sleeps() -> None:
    rules = shipped_rules()
    sleeper = Contract("sleeper", gives=("region",), awake=NEAR)
    eye = Contract("eye", gives=("region",))
    assert always_active([sleeper], rules) == {"sleeper"}
    assert always_active([sleeper, eye], rules) == frozenset()
    assert (
        always_active([sleeper], parse_rules('rule r(a): info when moving(a) say "{a}"'))
        == frozenset()
    )
    agent = build_agent(WatchSettings("clip"), extra=[Lens(awake=NEAR)])
    assert agent.limits.never_asleep == frozenset()


KINDS = st.sets(st.sampled_from(["region", "health", "hypothesis", "depth", "own"]), min_size=1)


@given(st.lists(st.tuples(KINDS, st.booleans()), min_size=1, max_size=5))
def test_no_kind_that_safety_rules_read_sleeps_altogether(
    drawn: list[tuple[set[str], bool]],
) -> None:
    contracts = [
        Contract(f"b{k}", tuple(sorted(kinds)), awake=NEAR if sleeps else "")
        for k, (kinds, sleeps) in enumerate(drawn)
    ]
    rules = shipped_rules()
    up = {c.name for c in contracts if not c.awake} | always_active(contracts, rules)
    given_by = {kind for c in contracts if c.name in up for kind in c.gives}
    for kind in ("region", "health"):
        if any(kind in c.gives for c in contracts):
            assert kind in given_by


def test_going_back_and_on_wakes_alike() -> None:
    """What these rules remember is in the mind, like everything."""
    rules = default_reasoners()
    lens = Lens(awake=f"{NEAR} for 0.5 s")
    reasoners = Reasoners(
        rules.update,
        rules.cogitate,
        attend=(ActivationReasoner(activation_rules([lens.contract])),),
    )
    agent = Agent([Eye(), lens], reasoners, limits=Limits(hang_s=None))
    seen = [agent.step(s.frame).observation for s in CLIP]
    again = Agent([], reasoners)
    kept, first = [], []
    for one in seen:
        kept.append(again.snapshot())
        first.append(again.reason(one).directives)
    assert any(first)
    for k in (10, 25, 40):
        again.restore(kept[k])
        assert [again.reason(one).directives for one in seen[k:]] == first[k:]


def test_a_behaviour_that_is_never_called_changes_nothing_that_is_told() -> None:
    never = Lens(awake="speed(a) > 1000000 px/s")
    assert [s.events for s in run(never)] == [s.events for s in run()]

"""Recognition: laws of the model, the exact oracle, and what is told of where a task is."""

from __future__ import annotations

import random
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.oracles.reasoning.recognition import compare, follow
from tests.oracles.recognition_tasks import Draw, text_of
from visup.agent import Status
from visup.tasks.automaton.automaton import END
from visup.tasks.automaton.backpointers import Revision, revisions
from visup.tasks.automaton.hidden_phases import (
    ActionEvidence,
    ActionKey,
    HiddenFilter,
    HiddenPosterior,
    hidden_filter,
)
from visup.tasks.automaton.stage_hmm import DEFAULT_HMM, ActionStatus, PhaseKind, StageHmm
from visup.tasks.automaton.states import TaskStep
from visup.tasks.automaton.transitions import HiddenState, HiddenTransitions
from visup.tasks.grammar.parser import read

ROW = "<t> ::= <one> <two> <three>\n<one> ::= a(x)\n<two> ::= b(x)\n<three> ::= c(x)"
HELD = TaskStep("a", ("x",), "t", 2.0)
PLAIN = TaskStep("a", ("x",), "t")
SURE = StageHmm(lose=0.0)
"""Nothing is ever lost."""
LAW = settings(max_examples=40, deadline=None)


def seeing(*holding: str, among: str = "abc") -> dict[ActionKey, ActionEvidence]:
    statuses = {k: ActionStatus.HOLDS if k in holding else ActionStatus.NEITHER for k in among}
    return {(k, ("x",)): ActionEvidence(s) for k, s in statuses.items()}


def followed(
    recogniser: HiddenFilter, letters: str, among: str = "abc", dt: float = 0.2
) -> list[HiddenPosterior]:
    """Beliefs after each letter of what is seen; `.` for nothing at all."""
    beliefs = [recogniser.start()]
    for letter in letters:
        observed = {} if letter == "." else seeing(letter, among=among)
        beliefs.append(recogniser.step(beliefs[-1], observed, dt))
    return beliefs


def test_the_filter_agrees_with_enumeration_on_small_tasks() -> None:
    agreed = compare(25, first=5_000)
    assert agreed.steps > 100
    assert agreed.worst <= 1e-6
    assert agreed.worst_success <= 1e-6
    assert not agreed.other


@LAW
@given(st.integers(0, 10**6), st.sampled_from([0.04, 0.3, 5.0]))
def test_transition_probabilities_from_a_state_sum_to_one(seed: int, dt: float) -> None:
    task = read(text_of(Draw(random.Random(seed)).rules()))
    recogniser = hidden_filter(task)
    transitions = HiddenTransitions(recogniser.automaton, DEFAULT_HMM)
    states = [p for p, _ in transitions.begin()]
    for state in states[:5]:
        outgoing = transitions.transitions(state, dt)
        assert sum(p.chance for p in outgoing) == pytest.approx(1.0)
        states += [p.to for p in outgoing]


@pytest.mark.parametrize("step", [HELD, PLAIN])
@given(dt=st.floats(0.001, 100.0))
def test_phase_change_probabilities_sum_to_one(step: TaskStep, dt: float) -> None:
    for phase in range(DEFAULT_HMM.count(step) + 3):
        changes = list(DEFAULT_HMM.changes(step, phase, dt))
        assert sum(p for _, p in changes) == pytest.approx(1.0)
        assert all(p >= 0 for _, p in changes)


@given(st.sampled_from(PhaseKind), st.floats(0.0, 1.0))
def test_emission_probabilities_sum_to_one(kind: PhaseKind, confidence: float) -> None:
    assert sum(DEFAULT_HMM.chances[kind]) == pytest.approx(1.0)
    assert DEFAULT_HMM.likelihood(kind, ActionStatus.UNKNOWN, confidence) == 1.0
    for status in ActionStatus:
        assert DEFAULT_HMM.likelihood(kind, status, 0.0) == pytest.approx(1.0)


def test_unknown_observations_change_only_the_time() -> None:
    recogniser = hidden_filter(read(ROW))
    before = followed(recogniser, "aaa")[-1]
    unknown = {key: ActionEvidence(ActionStatus.UNKNOWN) for key in seeing()}
    assert (
        recogniser.step(before, unknown, 0.5).hypotheses
        == recogniser.step(before, {}, 0.5).hypotheses
    )
    same = recogniser.step(before, unknown, 0.0)
    for state, weighed in before.hypotheses.items():
        assert same.hypotheses[state].mass == pytest.approx(weighed.mass)


@LAW
@given(st.integers(0, 10**6))
def test_the_filter_does_not_depend_on_the_division_of_time(seed: int) -> None:
    """While nothing is seen, many short steps and few longer ones come to nearly the same."""
    recogniser = hidden_filter(read(ROW), least=0.0)
    before = followed(recogniser, random.Random(seed).choice(["aaaa", "aab", "abbbc"]))[-1]
    short = before
    for _ in range(20):
        short = recogniser.step(short, {}, 0.01)
    middle = before
    for _ in range(10):
        middle = recogniser.step(middle, {}, 0.02)
    fine, coarse = recogniser.stages(short), recogniser.stages(middle)
    for key, chance in fine.items():
        assert coarse.get(key, 0.0) == pytest.approx(chance, abs=0.002)


def test_a_task_is_followed_from_stage_to_stage() -> None:
    recogniser = hidden_filter(read(ROW))
    beliefs = followed(recogniser, "aaaaaabbbbbbcccccc")
    stages = [recogniser.most_likely(b)[0] for b in beliefs[1:]]
    assert stages == sorted(stages, key=["one", "two", "three"].index)
    assert recogniser.most_likely(beliefs[6]) == ("one", Status.PROGRESSING)
    stage, chance = recogniser.ranking(beliefs[-1])[0]
    assert stage == "three"
    assert chance > 0.98


def test_one_wrong_observation_does_not_mislead_the_filter() -> None:
    recogniser = hidden_filter(read(ROW))
    beliefs = followed(recogniser, "aaaaaacaaabaaaaaaa")
    assert {recogniser.most_likely(b)[0] for b in beliefs[4:]} == {"one"}


def test_lasting_contrary_evidence_makes_a_stage_fail() -> None:
    recogniser = hidden_filter(read(ROW))
    belief = followed(recogniser, "aaaaa")[-1]
    successes = [recogniser.success(belief)]
    for _ in range(6):
        observed = {**seeing(), ("a", ("x",)): ActionEvidence(ActionStatus.CONTRARY)}
        belief = recogniser.step(belief, observed, 0.2)
        successes.append(recogniser.success(belief))
    assert recogniser.most_likely(belief) == ("one", Status.FAILING)
    assert successes == sorted(successes, reverse=True)
    assert (
        recogniser.success(followed(recogniser, "aaaaabbbbbccccc")[-1])
        > successes[0]
        > successes[-1]
    )


def test_possible_next_stages_have_equal_probability() -> None:
    task = "<t> ::= <a> (<b> | <c> <b>)\n<a> ::= a(x)\n<b> ::= b(x)\n<c> ::= c(x)"
    recogniser = hidden_filter(read(task), SURE)
    assert dict(recogniser.next_stages(recogniser.start())) == {
        "b": pytest.approx(0.5),
        "c": pytest.approx(0.5),
    }
    assert dict(recogniser.next_stages(followed(recogniser, "aaaabbbbbbbb")[-1])).get("b", 0) < 0.1


def test_what_comes_next_is_a_stage_however_many_steps_away() -> None:
    task = "<t> ::= <a> <b>?\n<a> ::= (a(x) c(x))+\n<b> ::= b(x)"
    recogniser = hidden_filter(read(task), SURE)
    coming = dict(recogniser.next_stages(recogniser.start()))
    # From c: a again, b, or the end; a leads back to c: p = 1/3 p + 1/3.
    assert coming == {"b": pytest.approx(0.5, abs=1e-6), "": pytest.approx(0.5, abs=1e-6)}


@LAW
@given(st.floats(0.0, 1.0), st.sampled_from([ROW, "<t> ::= (a(x) for 2 s b(x))+ c(x)?"]))
def test_success_is_among_the_next_stages(lose: float, text: str) -> None:
    recogniser = hidden_filter(read(text), StageHmm(lose=lose))
    start = recogniser.start()
    coming = sum(chance for _, chance in recogniser.next_stages(start))
    assert recogniser.success(start) <= coming + 1e-6 <= 1.0 + 2e-6


@pytest.mark.parametrize(
    "text", [ROW, "<t> ::= (a(x) for 2 s b(x))+ c(x)?", "<t> ::= a(x) | b(x) <t>"]
)
def test_success_is_the_share_of_courses_that_end(text: str) -> None:
    """Letting the model run until all is over finds what is told beforehand."""
    process = StageHmm(begin=2.0, leave=1.0, fail=0.2, recover=0.3, lose=0.2, skip=0.05)
    recogniser = hidden_filter(read(text), process, most=10**6, least=1e-12)
    belief = recogniser.start()
    hope = recogniser.success(belief)
    for _ in range(3_000):
        belief = recogniser.step(belief, {}, 0.05)
    ended = belief.hypotheses[HiddenState(END, ())].mass
    assert 0.1 < hope < 0.95
    assert ended == pytest.approx(hope, abs=0.01)


def taken_back(beliefs: list[HiddenPosterior]) -> list[Revision]:
    """The steps told done on the way that later turn out not to have been."""
    pairs = pairwise(beliefs)
    return [r for a, b in pairs for r in revisions(a.likeliest, b.likeliest, b.time)]


def test_conclusions_that_later_evidence_contradicts_are_revised() -> None:
    task = "<t> ::= a(x) | <long> <other>\n<long> ::= b(x)\n<other> ::= c(x)"
    recogniser = hidden_filter(read("<t> ::= <one> <two>\n<one> ::= a(x)\n<two> ::= b(x)"))
    beliefs = followed(recogniser, "aaaaabbb" + "a" * 12, among="ab")
    revised = taken_back(beliefs)
    assert [r.step.stage for r in revised] == ["one"]
    assert 1.0 < revised[0].reported < revised[0].revised
    assert "`one`, reported complete at" in revised[0].text()
    assert "now believed not to have happened" in revised[0].text()
    steady = followed(hidden_filter(read(task)), "bbbbbbccccc")
    assert not taken_back(steady)


def test_a_retry_is_followed_however_often_it_comes() -> None:
    task = "<t> ::= <try> (<done> | <back> <t>)\n<try> ::= a(x)\n<back> ::= b(x)\n<done> ::= c(x)"
    recogniser = hidden_filter(read(task))
    beliefs = followed(recogniser, "aaaaabbbbb" * 8 + "ccccccccc")
    assert recogniser.most_likely(beliefs[78])[0] == "back"
    assert recogniser.most_likely(beliefs[-1])[0] == "done"
    assert len(recogniser.automaton) < 20  # a retry at the end of its task needs no stack


def test_a_recursive_task_is_expanded_within_a_bound() -> None:
    task = read("<t> ::= any order (<u>, e(x)?) | b(x) <t>\n<u> ::= d(x)? | c(x) <t>")
    recogniser = hidden_filter(task)
    assert 0.5 < recogniser.success(recogniser.start()) < 1.0
    assert len(recogniser.automaton) < 3_000


def test_states_are_limited_and_the_dropped_mass_is_recorded() -> None:
    task = read("<t> ::= any order (a(x), b(x), c(x), d(x), e(x))")
    few, all_of_them = hidden_filter(task, most=40), hidden_filter(task, most=10**6, least=0.0)
    letters = "aaaaaccccceeeee"
    limited, unlimited = (
        followed(few, letters, "abcde")[-1],
        followed(all_of_them, letters, "abcde")[-1],
    )
    assert len(limited.hypotheses) <= 40 < len(unlimited.hypotheses)
    assert 0.0 < limited.lost < 0.05
    assert unlimited.lost == pytest.approx(0.0, abs=1e-12)
    assert few.most_likely(limited) == all_of_them.most_likely(unlimited)


def test_the_truth_is_dropped_no_more_often_than_recorded() -> None:
    """Over streams that the model itself draws, with far too few places kept."""
    task = read("<t> ::= any order (a(x), b(x), c(x))")
    recogniser = hidden_filter(task, most=4)
    dropped, accounted = 0, 0.0
    for seed in range(60):
        truths, belief = drawn(recogniser, random.Random(seed)), recogniser.start()
        missed = False
        for state, observed in truths:
            belief = recogniser.step(belief, observed, 1.0)
            missed = missed or state not in belief.hypotheses
        dropped += missed
        accounted += belief.lost
    assert dropped > 0
    assert dropped <= accounted + 3 * accounted**0.5


def drawn(
    recogniser: HiddenFilter, rng: random.Random
) -> list[tuple[HiddenState, dict[ActionKey, ActionEvidence]]]:
    """Where a task is at each second, and what is seen of it, by the model itself."""
    transitions = HiddenTransitions(recogniser.automaton, DEFAULT_HMM)
    state = rng.choice([p for p, _ in transitions.begin()])
    stream = []
    for _ in range(25):
        outgoing = transitions.transitions(state, 1.0)
        state = rng.choices(outgoing, [p.chance for p in outgoing])[0].to
        required = dict(transitions.required(state))
        observed = {}
        for key in seeing():
            chances = DEFAULT_HMM.chances[required.get(key, PhaseKind.WAITING)]
            observed[key] = ActionEvidence(ActionStatus(rng.choices(range(3), chances)[0]))
        stream.append((state, observed))
    return stream


def test_large_tasks_are_followed_through_wrong_verdicts() -> None:
    run = follow(12, seed=3, mean_s=6.0)
    assert run.right >= 0.95
    assert run.differs == 0.0
    assert run.dropped_truth == 0

"""The vote of the paper: its three principles, its formula, the open set."""

from math import exp

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.rules.runs import reason
from tests.rules.scenes import box_region, seen
from visup.agent import Hypothesis, ReportState
from visup.rules.identity.votes import VoteSettings, candidates, update_votes, weights

SET = VoteSettings()
names = st.sampled_from("abcdef")
similarity = st.floats(0.0, 1.0)
some = settings(max_examples=60, deadline=None)


def share(tally: tuple[tuple[str, float], ...], name: str) -> float:
    total = sum(v for _, v in tally)
    return dict(tally).get(name, 0.0) / total if total else 0.0


@some
@given(st.lists(names, min_size=8, max_size=40), st.floats(0.45, 1.0))
def test_recurrent_hypotheses_beat_those_that_change(others: list[str], s: float) -> None:
    """'z' comes in every step, the others each in their turn, all equally similar."""
    tally: tuple[tuple[str, float], ...] = ()
    for i, other in enumerate(others):
        said = (Hypothesis(1, "z", 0, s), Hypothesis(1, f"{other}{i % 3}", 0, s - 0.01))
        tally = update_votes(tally, weights(said, SET), 0.1, SET.tau_s, SET.most_candidates)
    assert tally[0][0] == "z"
    assert share(tally, "z") > max(share(tally, n) for n, _ in tally if n != "z")


@some
@given(st.floats(0.5, 1.0), st.floats(0.5, 20.0))
def test_what_is_not_hypothesised_is_forgotten(s: float, silence: float) -> None:
    tally = update_votes((), weights((Hypothesis(1, "a", 0, s),), SET), 0.0, SET.tau_s, 5)
    later = update_votes(tally, {}, silence, SET.tau_s, 5)
    assert dict(later).get("a", 0.0) < tally[0][1] * exp(-0.49 * silence / SET.tau_s)


@some
@given(st.floats(0.5, 1.0), st.floats(0.1, 10.0))
def test_hidden_objects_keep_their_votes_longer(s: float, hidden: float) -> None:
    tally = update_votes((), weights((Hypothesis(1, "a", 0, s),), SET), 0.0, SET.tau_s, 5)
    held = dict(update_votes(tally, {}, hidden, SET.tau_hidden_s, 5)).get("a", 0.0)
    lost = dict(update_votes(tally, {}, hidden, SET.tau_s, 5)).get("a", 0.0)
    assert held > lost
    assert held > 0.8 * tally[0][1]


@some
@given(st.lists(st.tuples(names, similarity), max_size=12))
def test_weights_are_best_per_name_above_threshold_and_discounted_by_rank(
    said: list[tuple[str, float]],
) -> None:
    """The dumb twin: sort the best similarity of each name and count places by hand."""
    best = {n: max(s for m, s in said if m == n) for n, _ in said}
    order = sorted((n for n in best if best[n] > 0.4), key=lambda n: (-best[n], n))
    twin = {n: SET.rank**k * (best[n] - 0.4) / 0.6 for k, n in enumerate(order)}
    assert weights(tuple(Hypothesis(1, n, 0, s) for n, s in said), SET) == pytest.approx(twin)


@some
@given(st.lists(st.floats(0.41, 1.0), min_size=1, max_size=30), st.floats(0.02, 0.5))
def test_votes_follow_the_formula(similarities: list[float], dt: float) -> None:
    votes = 0.0
    tally: tuple[tuple[str, float], ...] = ()
    for s in similarities:
        votes = votes * exp(-dt / SET.tau_s) + (s - 0.4) / 0.6
        tally = update_votes(tally, weights((Hypothesis(1, "a", 0, s),), SET), dt, SET.tau_s, 5)
    assert dict(tally).get("a", 0.0) == pytest.approx(votes, abs=1e-3)


@some
@given(st.lists(st.tuples(names, st.floats(0.0, 5.0)), max_size=8))
def test_candidates_are_few_ordered_and_shares_of_one(raw: list[tuple[str, float]]) -> None:
    tally = tuple(sorted(dict(raw).items(), key=lambda i: (-i[1], i[0])))
    found = candidates(tally, SET)
    assert len(found) <= SET.most_candidates
    assert [c.share for c in found] == sorted((c.share for c in found), reverse=True)
    assert sum(c.share for c in found) <= 1.0 + 1e-9


def run(similarity: float, lost_from: int = 10**9, steps: int = 60) -> tuple[float, str, int]:
    """Votes, name and number of 'identified' events for a still box."""
    observations = [
        seen(
            i,
            [box_region(1, (100, 100, 80, 60))],
            names={1: [("probe", similarity)]} if i < lost_from else {},
            state=ReportState.RAN if i < lost_from else ReportState.FAILED,
        )
        for i in range(steps)
    ]
    thoughts = reason(observations)
    belief = thoughts[-1].mind.objects[1]
    votes = belief.candidates[0].votes if belief.candidates else 0.0
    told = sum(e.kind == "identified" for t in thoughts for e in t.events)
    return votes, belief.name, told


def test_an_object_like_nothing_known_stays_an_unknown_object() -> None:
    assert run(0.39)[1:] == ("unknown object", 0)


def test_an_identity_is_told_once() -> None:
    assert run(0.8)[1:] == ("probe", 1)


def test_votes_are_held_while_nobody_can_look() -> None:
    """Two seconds without any report fade votes by what hiding allows, not by what absence does."""
    before, _, _ = run(0.8, steps=50)
    after, name, _ = run(0.8, lost_from=50, steps=100)
    assert name == "probe"
    assert after > 0.95 * before

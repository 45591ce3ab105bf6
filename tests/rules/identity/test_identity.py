"""Who is who over time: strangers, occlusion, crossings, and how sure it is."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.rules.runs import reason
from tests.rules.scenes import box_region, seen
from visup.agent import Observation, Region
from visup.evaluation.calibration import Calibration
from visup.rules.identity.votes import VoteSettings, candidates, unknown_probability

SET = VoteSettings()
CROWD = tuple(f"model {k}" for k in range(30))


@pytest.mark.parametrize(
    "said",
    [
        lambda rng: [("probe", 0.46)],
        lambda rng: [(str(n), 0.7 - 0.05 * k) for k, n in enumerate(rng.choice(CROWD, 4, False))],
    ],
    ids=["weak", "scattered"],
)
def test_what_is_like_nothing_known_ends_as_unknown_with_confidence(said) -> None:  # type: ignore[no-untyped-def]
    rng = np.random.default_rng(5)
    box = box_region(1, (200, 150, 90, 70))
    seq = [seen(i, [box], names={1: said(rng)} if i % 5 == 0 else {}) for i in range(400)]
    belief = reason(seq)[-1].mind.objects[1]
    assert belief.name == "unknown object"
    assert belief.confidence > 0.6


@settings(max_examples=40, deadline=None)
@given(
    st.lists(st.tuples(st.sampled_from("abcdefg"), st.floats(0.0, 12.0)), max_size=7),
    st.floats(0.0, 5.0),
)
def test_likelihoods_of_all_names_and_of_none_add_up_to_one(
    raw: list[tuple[str, float]], stranger: float
) -> None:
    tally = tuple(sorted(dict(raw).items(), key=lambda i: (-i[1], i[0])))
    every = VoteSettings(most_candidates=20, least_share=0.0, known_votes=0.0)
    found = candidates(tally, every, stranger)
    whole = sum(c.confidence for c in found) + unknown_probability(tally, every, stranger)
    # Named or not: an object without candidates keeps the likelihoods of its names to itself.
    assert whole == pytest.approx(1.0) if found else whole <= 1.0 + 1e-9
    assert [c.confidence for c in found] == sorted((c.confidence for c in found), reverse=True)


def test_hypotheses_of_one_picture_count_once() -> None:
    """Told in every frame or five times a second: much the same votes."""
    box = box_region(1, (200, 150, 90, 70))
    votes = [
        reason(
            [seen(i, [box], names={1: [("probe", 0.8)]} if i % n == 0 else {}) for i in range(100)]
        )[-1].mind.objects[1]
        for n in (1, 5)
    ]
    often, seldom = (b.candidates[0].votes for b in votes)
    assert often == pytest.approx(seldom, rel=0.15)


def crossing(i: int, ids: tuple[int, int]) -> list[Region | None]:
    """A large box passes before a small one, which is hidden from 3.0 s to 4.9 s."""
    left = -150 + 5 * i
    parts: list[Region | None] = [box_region(ids[0], (left, 100, 140, 160))]
    x0, x1 = 300, 350
    if left + 140 <= x0 or left >= x1:
        parts.append(box_region(ids[1], (x0, 150, 50, 50)))
    elif left > x0:
        parts.append(box_region(ids[1], (x0, 150, left - x0, 50)))
    elif left + 140 < x1:
        parts.append(box_region(ids[1], (left + 140, 150, x1 - left - 140, 50)))
    return parts


@pytest.mark.parametrize("fresh", [False, True], ids=["same id", "new id"])
def test_identity_survives_a_crossing_and_goes_to_nobody_else(fresh: bool) -> None:
    names = {1: [("large", 0.75), ("small", 0.6)], 2: [("small", 0.75), ("large", 0.6)]}
    names[9] = names[2]

    def at(i: int) -> Observation:
        ids = (1, 9 if fresh and i > 105 else 2)
        told = {n: names[n] for n in ids} if i % 5 == 0 else {}
        return seen(i, crossing(i, ids), names=told)

    for thought in reason([at(i) for i in range(175)])[60:]:
        for belief in thought.mind.objects.values():
            if belief.confirmed and belief.last_seen == thought.mind.time:
                assert belief.name == ("large" if belief.region.bbox[3] > 100 else "small")
    known = {b.name: b.id for b in thought.mind.objects.values() if b.confirmed}
    assert set(known) == {"large", "small"}
    assert known["small"] == 2


def test_another_body_that_comes_out_from_behind_is_not_the_one_that_went_there() -> None:
    """What appears at the place of a hidden object, surely something else, is not it."""

    def at(i: int) -> Observation:
        region = box_region(1, (200, 150, 60, 60)) if i < 100 else None
        cover = box_region(2, (190, 140, 80, 80)) if 95 <= i < 150 else None
        other = box_region(3, (203, 153, 57, 57)) if i >= 150 else None
        said = {1: [("first", 0.9)], 2: [("cover", 0.9)], 3: [("second", 0.9)]}
        present = [r for r in (region, cover, other) if r is not None]
        return seen(i, present, names={r.id: said[r.id] for r in present})

    told = reason([at(i) for i in range(400)])[-1].mind
    there = [b for b in told.objects.values() if b.last_seen == told.time and b.confirmed]
    assert [(b.region.id, b.name) for b in there] == [(3, "second")]


def test_calibration_counts_as_by_hand() -> None:
    assert Calibration().error() is None
    counted = Calibration()
    said = [(0.95, True), (0.95, False), (0.15, False), (1.0, True)]
    for confidence, right in said:
        counted.add(confidence, right)
    assert counted.error() == pytest.approx((abs(2.9 - 2) + abs(0.15 - 0)) / 4)
    twice = Calibration()
    twice.join(counted.counts())
    twice.join(counted.counts())
    assert twice.error() == pytest.approx(counted.error())
    assert [r["count"] for r in twice.table()] == [2, 6]

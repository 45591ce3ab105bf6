"""What a silhouette tells of models that a task awaits."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.rules.runs import think
from tests.rules.scenes import box_region, seen
from visup.agent import ObjectBelief, Observation, Report, ReportState
from visup.rules.identity.votes import ObjectVotes, Tally, VoteSettings, total_votes, update_tally
from visup.rules.reasoners import default_reasoners

SET = VoteSettings()
INSIDE, AT_BORDER = (200, 150, 90, 70), (0, 150, 90, 70)
votes = st.lists(st.tuples(st.sampled_from("abcd"), st.floats(0.0, 20.0)), max_size=4).map(
    lambda raw: tuple(sorted(dict(raw).items(), key=lambda i: (-i[1], i[0])))
)


def apart(observation: Observation) -> Observation:
    """The same, regions and hypotheses told by two behaviours, as motion and shape do."""
    both, fit = observation.reports
    parts = tuple(
        Report(kind, ReportState.RAN, (kind,), tuple(p for p in both.percepts if p.kind == kind))
        for kind in ("region", "hypothesis")
    )
    return replace(observation, reports=(*parts, fit))


def believed(
    said: Callable[[int], Iterable[tuple[str, float]]],
    box: Callable[[int], tuple[int, int, int, int]],
    steps: int = 200,
    actors: dict[str, tuple[str, ...]] | None = None,
) -> ObjectBelief:
    """What is believed of one body, looked at five times a second."""
    seq = [
        apart(seen(i, [box_region(1, box(i))], names={1: said(i)} if i % 5 == 0 else {}))
        for i in range(steps)
    ]
    return list(think(default_reasoners().update + default_reasoners().cogitate, seq, actors))[
        -1
    ].mind.objects[1]


@settings(max_examples=40, deadline=None)
@given(votes, votes, st.floats(0.0, 20.0))
def test_votes_of_all_looks_are_added_up(
    shape: tuple[tuple[str, float], ...], found: tuple[tuple[str, float], ...], none: float
) -> None:
    counted = total_votes(
        ObjectVotes(shape=Tally(shape, none), found=Tally(found, none)), SET, {"a"}
    )
    for name, v in counted.counts:
        own = dict(shape).get(name, 0.0) + dict(found).get(name, 0.0)
        assert v == pytest.approx(own + SET.awaited_votes * (name == "a" and not found))
    assert counted.none == pytest.approx(2.0 * none)
    assert [v for _, v in counted.counts] == sorted((v for _, v in counted.counts), reverse=True)


@settings(max_examples=40, deadline=None)
@given(votes, st.floats(0.0, 20.0), st.floats(0.0, 5.0))
def test_where_nobody_looked_a_tally_only_fades(
    counts: tuple[tuple[str, float], ...], none: float, dt: float
) -> None:
    after = update_tally(Tally(counts, none), Tally(), 0.0, (dt, SET.tau_s), 5)
    assert after.none <= none
    assert all(v <= dict(counts)[name] for name, v in after.counts)


@pytest.mark.parametrize(
    "looks",
    [
        [("airplane", 0.64), ("arm", 0.57), ("lamp", 0.55)],
        [("ladder", 0.74), ("tower_crane", 0.70), ("arm", 0.60)],
    ],
)
def test_of_names_that_a_cut_silhouette_allows_the_awaited_one_is_believed(
    looks: list[tuple[str, float]],
) -> None:
    alone = believed(lambda _: looks, lambda _: AT_BORDER)
    awaited = believed(lambda _: looks, lambda _: AT_BORDER, actors={"arm": ("arm",)})
    assert (alone.name, awaited.name) == (looks[0][0], "arm")


def test_what_is_awaited_is_not_seen_in_what_looks_otherwise() -> None:
    def said(i: int) -> list[tuple[str, float]]:
        return [("dish", 0.85), ("arm", 0.45)]

    assert believed(said, lambda i: INSIDE, actors={"arm": ("arm",)}).name == "dish"


@pytest.mark.parametrize(("box", "counts"), [(INSIDE, True), (AT_BORDER, False)])
def test_views_must_agree_unless_the_border_cuts_the_body(
    box: tuple[int, int, int, int], counts: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The visible part of an arm that comes in keeps changing."""

    def votes_of(support: float) -> float:
        told = "visup.rules.identity.identification.pose_support"
        monkeypatch.setattr(told, lambda *_: support)
        return believed(lambda _: [("arm", 0.9)], lambda _: box).candidates[0].votes

    agreeing, contrary = votes_of(1.0), votes_of(0.8)
    assert agreeing > 1.0
    assert contrary == pytest.approx((0.8 if counts else 1.0) * agreeing)

"""Relations of scripted boxes: trends, noise, drift, depth, flicker."""

from collections.abc import Callable, Iterator

import numpy as np
import pytest

from tests.rules.runs import Thought, reason
from tests.rules.scenes import box_region, seen
from visup.agent import Mind, Observation, Relation, Truth
from visup.rules.relations._pair_states_jit import classify_trend, combined_trend
from visup.rules.relations.reasoner import kinematics
from visup.rules.relations.trend import CONVERGING, DIVERGING, KEEPING

Place = Callable[[float], float]


def two_boxes(
    left: Place, right: Place, seconds: float, noise: float = 0.0, fps: float = 25.0
) -> Iterator[Observation]:
    """Two boxes of 80 x 60 px whose left edges are functions of time; jitter of each box."""
    rng = np.random.default_rng(7)
    for i in range(round(seconds * fps)):
        jitter = noise * rng.standard_normal((2, 2))
        xs = (left(i / fps), right(i / fps))
        yield seen(
            i,
            [
                box_region(n + 1, (x + jitter[n, 0], 200 + jitter[n, 1], 80, 60))
                for n, x in enumerate(xs)
            ],
            fps,
        )


def relation(mind: Mind, name: str) -> Relation:
    found = mind.relation(name, 1, 2)
    assert found is not None
    return found


def truths(run: list[Thought], name: str) -> list[Truth]:
    return [r.truth for t in run if (r := t.mind.relation(name, 1, 2)) is not None]


@pytest.mark.parametrize(
    ("speed", "name"),
    [(-25.0, "converging"), (-5.0, "converging"), (-2.5, "converging"), (0.0, "keeping_distance"),
     (2.5, "diverging"), (25.0, "diverging")],
)  # fmt: skip
def test_trend_is_told_within_two_seconds_whatever_the_speed(speed: float, name: str) -> None:
    run = reason(two_boxes(lambda t: 100, lambda t: 300 + speed * t, 2.4, 0.2))
    now = relation(run[-1].mind, name)
    assert now.truth is Truth.TRUE
    assert now.value == pytest.approx(speed, abs=1.0)
    others = {"converging", "diverging", "keeping_distance"} - {name}
    assert all(relation(run[-1].mind, o).truth is Truth.FALSE for o in others)


def test_still_boxes_with_jitter_change_no_relation_for_a_minute() -> None:
    run = reason(two_boxes(lambda t: 100, lambda t: 300, 60.0, 0.5))
    names = {r.name for r in run[-1].mind.relations} - {"distance"}
    for name in names:
        told = truths(run[100:], name)
        assert len(set(told)) == 1, name
    assert relation(run[-1].mind, "keeping_distance").truth is Truth.TRUE
    assert not [e for t in run for e in t.events if e.kind not in ("entry",)]


def test_bodies_that_part_after_contact_diverge_within_a_second() -> None:
    """Closing in at 15 px/s, contact at 6 s, then the right one drifts off at 8 px/s."""
    at = lambda t: 180 + (15 * max(0.0, 6 - t) if t < 6 else 8 * (t - 6))  # noqa: E731
    run = reason(two_boxes(lambda t: 100, at, 8.0, 0.3))
    first = {
        name: next(t.mind.time for t in run if relation_true(t.mind, name))
        for name in ("converging", "touching", "diverging")
    }
    assert first["converging"] < 2.0
    assert first["touching"] == pytest.approx(6.0, abs=0.4)
    assert 6.0 < first["diverging"] < 7.1


def relation_true(mind: Mind, name: str) -> bool:
    found = mind.relation(name, 1, 2)
    return found is not None and found.truth is Truth.TRUE


def test_flicker_of_a_region_leaves_relations_as_they_are() -> None:
    """Every fourth sighting of the second box is missing."""
    full = list(two_boxes(lambda t: 100, lambda t: 300 - 10 * t, 4.0, 0.2))
    kept = [
        seen(o.frame_index, [r for r in o.of("region") if r.id == 1 or o.frame_index % 4])
        for o in full
    ]
    told = truths(reason(iter(kept)), "converging")
    assert told.count(Truth.TRUE) > 50
    assert Truth.UNKNOWN not in told[40:]


def test_a_relation_to_what_is_not_seen_is_unknown_not_false() -> None:
    full = list(two_boxes(lambda t: 100, lambda t: 300 - 10 * t, 3.0))
    gone = [seen(i, [box_region(1, (100, 200, 80, 60))]) for i in range(75, 125)]
    run = reason(iter([*full, *gone]))
    for name in ("converging", "diverging", "keeping_distance", "touching"):
        assert relation(run[-1].mind, name).truth is Truth.UNKNOWN


@pytest.mark.parametrize(
    ("rate", "expected", "confident"),
    [(0.0, Truth.TRUE, True), (+0.8, Truth.UNKNOWN, False), (-0.8, Truth.TRUE, True)],
)
def test_depth_supports_or_contradicts_the_image(
    rate: float, expected: Truth, confident: bool
) -> None:
    """Boxes that close in on the image while their depth difference stays, grows, shrinks."""

    def at(i: int) -> Observation:
        t = i / 25
        return seen(
            i,
            [box_region(1, (100, 200, 80, 60)), box_region(2, (300 - 10 * t, 200, 80, 60))],
            names={1: [("probe", 0.9)], 2: [("dish", 0.9)]},
            depths={1: ("probe", 10.0), 2: ("dish", 14.0 + rate * t)},
        )

    now = relation(reason(at(i) for i in range(90))[-1].mind, "converging")
    assert now.truth is expected
    assert (now.confidence > 0.8) is confident


def test_without_depth_confidence_is_capped() -> None:
    run = reason(two_boxes(lambda t: 100, lambda t: 400 - 20 * t, 3.0))
    assert relation(run[-1].mind, "converging").confidence == pytest.approx(0.8)


def test_outlines_far_apart_in_depth_do_not_touch() -> None:
    observations = (
        seen(
            i,
            [box_region(1, (100, 200, 80, 60)), box_region(2, (180, 200, 80, 60))],
            names={1: [("probe", 0.9)], 2: [("dish", 0.9)]},
            depths={1: ("probe", 10.0), 2: ("dish", 16.0)},
        )
        for i in range(60)
    )
    assert relation(reason(observations)[-1].mind, "touching").truth is Truth.FALSE


def test_trend_does_not_depend_on_the_image_size_or_the_start_time() -> None:
    """The same motion scaled with the image, and shifted by an hour, gives the same truths."""
    run = reason(two_boxes(lambda t: 100, lambda t: 300 - 10 * t, 3.0))
    late = [
        Observation(o.frame_index, o.time + 3600.0, o.frame_size, o.reports)
        for o in two_boxes(lambda t: 100, lambda t: 300 - 10 * t, 3.0)
    ]
    assert truths(reason(iter(late)), "converging") == truths(run, "converging")


def test_time_runs_out_of_a_bounded_memory() -> None:
    run = reason(two_boxes(lambda t: 100, lambda t: 300, 8.0, fps=100.0))
    kept = run[-1].mind.memory["rules.relations"]
    assert len(kept.history.times) <= 65
    assert kinematics(run[-1].mind).pair("gap", 1, 2) == pytest.approx(120.0, abs=2.0)


def test_trend_thresholds_have_hysteresis() -> None:
    before = [KEEPING, CONVERGING, CONVERGING, DIVERGING, KEEPING]
    rates = [-1.2, -1.2, -0.5, 1.2, np.nan]
    wanted = [
        classify_trend(rate, 0.1, was, was, (1.6, 0.8), (3.0, 2.0))
        for rate, was in zip(rates, before, strict=True)
    ]
    assert wanted == [KEEPING, CONVERGING, KEEPING, DIVERGING, -1]


def test_a_trend_that_waits_is_not_taken_back_by_one_wide_deviation() -> None:
    def found(rate: float, sigma: float) -> list[int]:
        limits = (1.6, 0.8), (3.0, 2.0)
        return [
            classify_trend(rate, sigma, KEEPING, pending, *limits)
            for pending in (KEEPING, DIVERGING)
        ]

    for sigma, expected in (
        (1.0, [DIVERGING, DIVERGING]),
        (2.0, [KEEPING, DIVERGING]),
        (3.0, [KEEPING, KEEPING]),
    ):
        assert found(5.0, sigma) == expected
    assert found(-5.0, 2.0) == [KEEPING, KEEPING]


def test_depth_joins_the_image() -> None:
    image = [CONVERGING, CONVERGING, KEEPING, KEEPING, DIVERGING, -1]
    depth = [-1, DIVERGING, CONVERGING, -1, CONVERGING, CONVERGING]
    joined = [combined_trend(i, d) for i, d in zip(image, depth, strict=True)]
    assert joined == [CONVERGING, -1, CONVERGING, KEEPING, -1, -1]

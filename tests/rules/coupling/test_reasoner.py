"""Caught, bounced off, or passing: when two bodies are believed to be one."""

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
import pytest

from tests.rules.runs import Thought, reason
from tests.rules.scenes import box_region, seen
from visup.agent import Observation, Region, Truth
from visup.rules.coupling.evidence import common_speed, common_speed_nearby
from visup.rules.coupling.relative_motion import (
    OutlineTemplate,
    RelativeTrack,
    RelativeVelocity,
)

Place = Callable[[float], float]


def scene(right: Place, left: Place = lambda t: 100.0, seconds: float = 10.0) -> list[Thought]:
    def observations() -> Iterator[Observation]:
        for i in range(round(25 * seconds)):
            boxes = [(left(i / 25), 1), (right(i / 25), 2)]
            yield seen(i, [box_region(n, (x, 200, 80, 60)) for x, n in boxes])

    return reason(observations())


def moving_as(region: Region | None, velocity: tuple[float, float]) -> Region:
    """A region with image motion of its own."""
    assert region is not None
    return replace(region, velocity=velocity, velocity_sigma=1.0)


def told(thoughts: list[Thought]) -> list[tuple[str, float]]:
    return [
        (e.kind, e.time) for t in thoughts for e in t.events if e.kind in ("coupled", "decoupled")
    ]


def closing(t: float) -> float:
    """Comes from 60 px away at 15 px/s and is there at 4 s."""
    return 180 + 15 * max(0.0, 4 - t)


def test_what_comes_to_rest_at_another_is_coupled_soon() -> None:
    found = told(scene(closing))
    assert [k for k, _ in found] == ["coupled"]
    assert 4.0 < found[0][1] < 5.5


def test_what_bounces_off_is_never_coupled() -> None:
    for speed in (5.0, 8.0, 15.0):
        away = lambda t, v=speed: closing(t) if t < 4 else 180 + v * (t - 4)  # noqa: E731
        assert told(scene(away)) == []


def test_what_touches_from_the_start_without_motion_is_not_known_to_be_coupled() -> None:
    thoughts = scene(lambda t: 180.0)
    assert told(thoughts) == []
    touching = thoughts[-1].mind.relation("touching", 1, 2)
    assert touching is not None
    assert touching.truth is Truth.TRUE


def test_what_moves_together_in_touch_is_coupled_though_nobody_saw_them_meet() -> None:
    assert [k for k, _ in told(scene(lambda t: 180 + 12 * t, lambda t: 100 + 12 * t))] == [
        "coupled"
    ]


def test_what_keeps_its_distance_without_touch_is_not_coupled() -> None:
    thoughts = scene(lambda t: 240 + 12 * t, lambda t: 100 + 12 * t)
    assert told(thoughts) == []
    together = thoughts[-1].mind.relation("moving_together", 1, 2)
    assert together is not None
    assert together.truth is Truth.TRUE


def test_coupled_bodies_that_part_are_decoupled() -> None:
    found = told(scene(lambda t: closing(t) if t < 7 else 180 + 15 * (t - 7)))
    assert [k for k, _ in found] == ["coupled", "decoupled"]
    assert 7.0 < found[1][1] < 9.0


def test_who_is_let_go_of_and_left_along_a_narrow_gap_is_decoupled() -> None:
    """A gripper opens by 7 px, and draws back past the part before it gets any farther from it."""

    def at(i: int) -> Observation:
        t = i / 25
        aside = 7.0 * min(max(0.0, t - 7) / 0.3, 1.0)
        boxes = [(100, 200, 80, 60), (closing(t) + aside, 200 - 20 * max(0.0, t - 8.5), 80, 60)]
        return seen(i, [box_region(n, box) for n, box in enumerate(boxes, start=1)])

    found = told(reason(at(i) for i in range(250)))
    assert [k for k, _ in found] == ["coupled", "decoupled"]
    assert 7.0 < found[1][1] < 9.8


@pytest.mark.parametrize("speed", [20.0, 30.0, 40.0])
def test_who_draws_away_is_decoupled_though_touch_ends_later(speed: float) -> None:
    """Outlines that have parted are followed no longer, and seem to touch until the gap is wider."""
    found = told(scene(lambda t: closing(t) if t < 7 else 180 + speed * (t - 7)))
    assert [k for k, _ in found] == ["coupled", "decoupled"]
    assert 7.3 < found[1][1] < 7.6


@pytest.mark.parametrize(("speed", "soon"), [(240.0, True), (15.0, False)])
def test_who_clearly_leaves_is_decoupled_at_once_and_others_after_a_while(
    speed: float, soon: bool
) -> None:
    thoughts = scene(lambda t: closing(t) if t < 8 else 180 + speed * (t - 8))
    (_, (kind, at)) = told(thoughts)
    assert kind == "decoupled"
    assert (at - 8.0 < 0.3) is soon


def test_who_is_decoupled_is_so_since_one_moment() -> None:
    """A stage that begins by it needs it to have lasted."""
    thoughts = scene(lambda t: closing(t) if t < 7 else 180 + 15 * (t - 7))
    ((_, at),) = (e for e in told(thoughts) if e[0] == "decoupled")
    after = [t.mind.relation("coupled", 1, 2) for t in thoughts if t.mind.time >= at]
    assert len(after) > 20
    assert {(r.truth, r.since) for r in after if r is not None} == {(Truth.FALSE, at)}


@pytest.mark.parametrize("parts_at", [None, 8.0])
def test_regions_that_become_their_union_are_coupled(parts_at: float | None) -> None:
    """The two close in; from contact on there is one region, which keeps its shape."""

    def at(i: int) -> Observation:
        t = i / 25
        parted = parts_at is not None and t >= parts_at
        x = 180 + 20 * (t - parts_at) if parts_at and parted else closing(t)
        if t < 4 or parted:
            return seen(i, [box_region(1, (100, 200, 80, 60)), box_region(2, (x, 200, 80, 60))])
        return seen(i, [box_region(1, (100, 200, 160, 60))])

    thoughts = reason(at(i) for i in range(300))
    found = told(thoughts)
    assert [k for k, _ in found] == (["coupled"] if parts_at is None else ["coupled", "decoupled"])
    assert 4.0 < found[0][1] < 6.5
    assert {e.kind for t in thoughts for e in t.events} <= {
        "entry", "relation", "coupled", "decoupled",
    }  # fmt: skip
    assert thoughts[190].mind.couplings[0].objects == (1, 2)


def test_a_region_that_hides_another_did_not_swallow_it() -> None:
    """The left box grows over the other one as a big object does that comes near."""

    def at(i: int) -> Observation:
        reach = min(200.0, 80 + 2.0 * max(0, i - 25))
        left = 100 + reach
        rest = box_region(2, (max(180.0, left), 220, 260 - max(180.0, left), 30))
        return seen(i, [box_region(1, (100, 150, reach, 160)), rest])

    assert told(reason(at(i) for i in range(200))) == []


def test_what_shows_of_a_hidden_body_at_the_edge_of_what_passes_does_not_couple_them() -> None:
    def observations() -> Iterator[Observation]:
        for i in range(300):
            edge = 200 + 30 * i / 25  # of the body that passes in front, to the right
            left = max(300.0, edge)
            rest = (left, 200, 380 - left, 60) if left < 372 else (edge, 205, 12, 40)
            regions = [box_region(1, rest), box_region(2, (edge - 200, 180, 200, 120))]
            yield seen(i, regions if edge < 560 else regions[1:])

    thoughts = reason(observations())
    assert any(e.kind == "occlusion" for t in thoughts for e in t.events)
    assert told(thoughts) == []


def test_what_is_being_covered_goes_no_faster_than_its_image_motion() -> None:
    """An arm rests and reaches in over the left border; what comes nearer covers it from its tip on."""

    def observations() -> Iterator[Observation]:
        for i in range(150):
            near = max(0.0, i / 25 - 2.0)
            front = 330 - 110 * near
            nearer = (front, 120 - 40 * near, 140 + 170 * near, 240 + 80 * near)
            cover = moving_as(box_region(2, nearer), (-25.0, 0.0))
            arm = (0, 220, min(300.0, front), 40)
            regions = [moving_as(box_region(1, arm), (0.5, 0.0))] if front > 60 else []
            yield seen(i, [*regions, cover])

    thoughts = reason(observations())
    assert told(thoughts) == []
    minds = [t.mind for t in thoughts if {1, 2} <= t.mind.objects.keys()]
    seen_now = [m for m in minds if m.objects[1].last_seen == m.time]
    assert len(seen_now) > 50
    assert all(common_speed(m, (1, 2)) <= 0.5 for m in seen_now)


@pytest.mark.parametrize(
    ("local", "relative", "speed"),
    [
        ((True, False), 0.0, 40.0),  # its hand goes where the cup goes
        ((True, False), 30.0, 10.0),
        ((True, False), 40.0, 0.0),  # its hand rests, too
        ((False, False), 0.0, 0.0),
        ((True, True), 0.0, 0.0),
        ((False, True), 0.0, 0.0),
    ],
)
def test_of_an_arm_only_what_is_near_the_other_body_counts(
    local: tuple[bool, bool], relative: float, speed: float
) -> None:
    """An arm rests as a whole, beside a cup that goes to the right at 40 px/s."""
    boxes = [[(100, 100, 200, 300), (302 + 1.6 * i, 150, 40, 40)] for i in range(50)]
    observed = (seen(i, [box_region(1, a), box_region(2, b)]) for i, (a, b) in enumerate(boxes))
    mind = reason(observed)[-1].mind
    arm, cup = (OutlineTemplate(np.zeros((0, 2)), np.zeros((0, 2)), local=k) for k in local)
    velocity = RelativeVelocity(np.array([relative, 0.0]), np.eye(2), 0.3)
    found = common_speed_nearby(mind, (1, 2), RelativeTrack(arm, cup, 0.0), velocity)
    assert found == pytest.approx(speed, abs=0.5)


@pytest.mark.parametrize(("slowdown", "parts"), [(0.0, False), (0.2, False), (0.8, True)])
def test_what_goes_where_its_carrier_goes_is_held_though_a_gap_opens(
    slowdown: float, parts: bool
) -> None:
    """An arm that lifts a cup leaves the picture: its fingers are seen no more, and a gap opens."""

    def at(i: int) -> Observation:
        t = i / 25
        rise = 20.0 * max(0.0, t - 4.0) if t < 6.0 else 40.0 + 80.0 * (t - 6.0)
        left = rise if t < 6.5 else 80.0 + (1.0 - slowdown) * 80.0 * (t - 6.5)
        lost = min(30.0, 60.0 * max(0.0, t - 6.5))  # of the arm's outline
        near = 80.0 * max(0.0, 1.0 - t / 2.0)
        arm = box_region(1, (100, 120 - rise - near, 120, 180 - lost))
        return seen(i, [arm, box_region(2, (130, 300 - left, 60, 80))])

    found = told(reason(at(i) for i in range(200)))
    assert [k for k, _ in found] == (["coupled", "decoupled"] if parts else ["coupled"])

"""Who carries what: a body that rested sets out while one moving body alone touches it."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from tests.rules.runs import Thought, reason
from tests.rules.scenes import box_region, seen
from visup.rules.coupling.carriers import CARRIERS

Box = tuple[float, float, float, float]
Course = Callable[[float], Box]
HAND, PART, OTHER = 1, 2, 3
LIFT_S = 4.0


def lifted(t: float, speed: float = 60.0) -> float:
    """How far up at that time, pixels, after a lift of two seconds."""
    return speed * min(max(0.0, t - LIFT_S), 2.0)


def arm(t: float) -> Box:
    """Comes down from beyond the upper border onto the part, and goes up with it shortly after."""
    return (200, 0, 30, min(300.0, 300 + 40 * (t - LIFT_S + 0.3)) - lifted(t))


def part(t: float) -> Box:
    return (190, 300 - lifted(t), 50, 50)


def scene(*courses: Course, seconds: float = 5.5) -> list[Thought]:
    return reason(
        seen(i, [box_region(n, at(i / 25)) for n, at in enumerate(courses, start=1)])
        for i in range(round(25 * seconds))
    )


def carried(thoughts: list[Thought]) -> dict[tuple[int, int], float]:
    """All pairs that were ever believed to carry each other, with the time of setting out."""
    found: dict[tuple[int, int], float] = {}
    for thought in thoughts:
        found.update(thought.mind.recall(CARRIERS).carried_since())
    return found


def test_what_an_arm_lifts_along_itself_is_coupled_from_its_first_motion_on() -> None:
    thoughts = scene(arm, part)
    (event,) = (e for t in thoughts for e in t.events if e.kind == "coupled")
    assert event.objects == (HAND, PART)
    assert event.time < LIFT_S + 0.8
    assert thoughts[-1].mind.couplings[0].since == pytest.approx(LIFT_S, abs=0.3)


def test_a_table_that_rests_under_it_does_not_matter() -> None:
    assert set(carried(scene(arm, part, lambda t: (200, 350, 30, 60)))) == {(HAND, PART)}


def test_where_two_movers_touch_it_nobody_is_believed_to_carry_it() -> None:
    def below(t: float) -> Box:
        return (200, 350 + 40 * max(0.0, LIFT_S - 0.3 - t) - lifted(t), 30, 60)

    assert carried(scene(arm, part, below)) == {}


def test_what_is_knocked_and_comes_to_rest_is_not_carried() -> None:
    knocked: Course = lambda t: (190, 300 - min(lifted(t), 8.0), 50, 50)  # noqa: E731
    assert carried(scene(arm, knocked)) == {}


@pytest.mark.parametrize(("speed", "carries"), [(60.0, True), (400.0, False)])
def test_who_goes_much_farther_passes_by(speed: float, carries: bool) -> None:
    """A long body that moves along another one, which sets out meanwhile: as fast, or much faster."""
    belt: Course = lambda t: (150, 150 - speed * (t - LIFT_S), 45, 2 * 480)  # noqa: E731
    assert ((HAND, PART) in carried(scene(belt, part))) is carries


@pytest.mark.parametrize(("down", "carries"), [(30.0, False), (-30.0, True)])
def test_who_is_thrown_off_is_not_carried_by_who_draws_back(down: float, carries: bool) -> None:
    """A satellite that is knocked flies off, while the arm that still covers a part of it draws back."""

    def hand(t: float) -> Box:
        return (200, 0, 30, 345 - 40 * abs(t - LIFT_S))

    def knocked(t: float) -> Box:
        return (190, 300 + down * max(0.0, t - LIFT_S), 50, 50)

    assert ((HAND, PART) in carried(scene(hand, knocked, seconds=4.9))) is carries


def test_what_moves_from_the_start_on_tells_nothing() -> None:
    hand: Course = lambda t: (100 + 12 * t, 200, 80, 60)  # noqa: E731
    held: Course = lambda t: (180 + 12 * t, 200, 80, 60)  # noqa: E731
    assert carried(scene(hand, held)) == {}


def test_what_is_let_go_of_is_carried_no_more() -> None:
    def dropped(t: float) -> Box:
        fallen = 300.0 * max(0.0, t - LIFT_S - 1.0) ** 2
        return (190, min(300.0, 300 - lifted(min(t, LIFT_S + 1.0)) + fallen), 50, 50)

    thoughts = scene(arm, dropped, seconds=7.0)
    assert set(carried(thoughts)) == {(HAND, PART)}
    assert thoughts[-1].mind.recall(CARRIERS).carried_since() == {}
    assert thoughts[-1].mind.couplings == ()

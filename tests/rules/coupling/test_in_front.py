"""What is carried and comes down past the foot of another body is in front of it, and does not touch it."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.rules.runs import Thought, reason
from tests.rules.scenes import box_region, seen
from visup.agent import Coupling, Mind, Truth, Verdict
from visup.agent.model.task_beliefs import TaskBelief
from visup.rules.coupling.contact import ContactSettings, Feet, OutlineContact, update_contact
from visup.rules.coupling.evidence import NO, YES, PairObservation, feet_of, move_alike

SPREADER, CONTAINER, TRUCK = 1, 2, 3
FOOT, HEIGHT = 330.0, 60.0
ON, BEFORE = FOOT - 30.0, FOOT + 40.0
"""Where the foot of the container ends: on the truck's bed, and on the ground in front of the truck."""


def load(foot: float, *, crane: bool = True) -> list[Thought]:
    """A crane takes a container, brings it before a truck, and lowers it until its foot is there."""

    def at(i: int) -> list[tuple[int, tuple[float, float, float, float]]]:
        t = i / 25 - 4.0
        x = 60.0 + 60.0 * min(max(0.0, t), 4.0)
        y = 180.0 + min(90.0 * max(0.0, t - 4.5), foot - HEIGHT - 180.0)
        above = 50.0 + 40.0 * max(0.0, -1.5 - t)
        container = (CONTAINER, (x, y, 90.0, HEIGHT))
        truck = (TRUCK, (260.0, 250.0, 180.0, FOOT - 250.0))
        spreader = (SPREADER, (x, y - above, 90.0, 50.0))
        return [spreader, container, truck] if crane else [container, truck]

    return reason(seen(i, [box_region(n, box) for n, box in at(i)]) for i in range(400))


def last(thoughts: list[Thought], name: str) -> Truth | None:
    return thoughts[-1].mind.truth(name, CONTAINER, TRUCK)


def test_what_is_set_down_on_another_touches_it() -> None:
    thoughts = load(ON)
    assert last(thoughts, "in_contact") is Truth.TRUE
    assert last(thoughts, "passing_by") is Truth.FALSE


def test_what_is_set_down_in_front_of_another_does_not_touch_it() -> None:
    thoughts = load(BEFORE)
    assert last(thoughts, "touching") is Truth.TRUE  # in the image
    assert last(thoughts, "in_contact") is Truth.FALSE
    assert last(thoughts, "passing_by") is Truth.TRUE
    pairs = [e.objects for t in thoughts for e in t.events if e.kind == "coupled"]
    assert (SPREADER, CONTAINER) in pairs
    assert (CONTAINER, TRUCK) not in pairs


def test_what_goes_by_itself_may_come_down_beside_another() -> None:
    """A vehicle that comes nearer along the ground may touch a charger with its far side."""
    thoughts = load(BEFORE, crane=False)
    assert last(thoughts, "in_contact") is Truth.TRUE


def contact(*feet: Feet | None) -> OutlineContact:
    """Two that meet, at rest, after looks at their feet."""
    found = None
    for k, look in enumerate(feet):
        found = update_contact(found, 0.0, 10.0, (k * 0.1, 0.1), ContactSettings(), feet=look)
    assert found is not None
    return found


def test_a_foot_that_is_covered_is_where_it_was() -> None:
    """A cup on a saucer covers the saucer's foot; what shows of the saucer ends higher."""
    covered = contact(Feet(80.0, 100.0, 40.0), Feet(98.0, 70.0, 40.0))
    assert not covered.in_front
    assert covered.lowest_foot == 100.0


@pytest.mark.parametrize(("foot", "front"), [(109.0, False), (111.0, True)])
def test_it_must_be_clearly_below(foot: float, front: bool) -> None:
    assert contact(Feet(80.0, 100.0, 40.0), Feet(foot, 100.0, 40.0)).in_front is front


def test_what_was_below_from_the_start_has_not_come_down() -> None:
    assert not contact(Feet(120.0, 100.0, 40.0), Feet(140.0, 100.0, 40.0)).in_front


def test_it_stays_in_front_once_it_is_let_go_of() -> None:
    found = contact(Feet(80.0, 100.0, 40.0), Feet(120.0, 100.0, 40.0), None, None)
    assert found.in_front
    assert found.confirmed_since is None


def test_what_is_lifted_again_is_no_longer_in_front() -> None:
    looks = [Feet(y, 100.0, 40.0) for y in (80.0, 120.0, 90.0, 90.0, 90.0)]
    assert not contact(*looks).in_front
    assert contact(*looks).confirmed_since is not None


@given(st.lists(st.floats(0, 400), min_size=1, max_size=20), st.floats(0, 400), st.floats(1, 200))
def test_nothing_is_in_front_whose_foot_is_higher(
    feet: list[float], ground: float, height: float
) -> None:
    found = contact(*(Feet(y, ground, height) for y in feet))
    assert not found.in_front or feet[-1] > ground >= min(feet)
    assert found.in_front == (min(feet) <= ground < feet[-1] - 0.25 * height)


@pytest.mark.parametrize(
    ("couplings", "machines", "known"),
    [
        ([], (), False),
        ([(SPREADER, CONTAINER)], (), True),
        ([(CONTAINER, TRUCK)], (), False),
        ([(SPREADER, CONTAINER), (SPREADER, TRUCK)], (), False),
        ([(SPREADER, CONTAINER)], ((SPREADER, CONTAINER),), False),
    ],
    ids=["nobody", "carried", "each other", "both", "a part of the same machine"],
)
def test_feet_count_if_a_third_one_carries_one_of_the_two(
    couplings: list[tuple[int, int]], machines: tuple[tuple[int, ...], ...], known: bool
) -> None:
    mind = load(ON)[-1].mind
    task = TaskBelief("load", Verdict.IN_PROGRESS, machines=machines)
    mind = replace(mind, couplings=tuple(Coupling(c, 0.0) for c in couplings), tasks=(task,))
    pair = PairObservation((CONTAINER, TRUCK), YES, NO, NO, 0.0, None)
    feet = feet_of(pair, mind)
    assert (feet == Feet(ON, FOOT, HEIGHT)) is known
    assert (feet is not None) is known


@pytest.mark.parametrize(
    ("speed", "ahead", "along"), [(100, 10, True), (100, 60, False), (10, 0, False)]
)
def test_two_go_along_if_both_are_fast_and_hardly_differ(
    speed: float, ahead: float, along: bool
) -> None:
    def at(i: int) -> list[tuple[float, float, float, float]]:
        x = 20.0 + speed * i / 25
        return [(x, 100.0, 60.0, 60.0), (x + ahead * i / 25, 240.0, 60.0, 60.0)]

    seq = (seen(i, [box_region(n, b) for n, b in enumerate(at(i), start=1)]) for i in range(50))
    mind: Mind = reason(seq)[-1].mind
    assert move_alike(mind, (1, 2)) is along

"""What is surely a thing of its own, known, or where it belongs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.rules.runs import reason
from tests.rules.scenes import box_region, seen
from visup.agent import Binding, Candidate, Mind, TaskBelief, Verdict
from visup.agent.model.mind import Zone
from visup.rules.formula.truth import YES
from visup.rules.predicates.certainty import (
    at_home,
    came_in,
    identified,
    near_moving_actor,
    standalone,
)
from visup.rules.predicates.snapshot import Codes, Snapshot

Rect = tuple[float, float, float, float]


def mind_of(*boxes: Rect, frames: int = 40) -> Mind:
    """The mind after some boxes rested for a while."""
    regions = [box_region(n + 1, box) for n, box in enumerate(boxes)]
    return reason(seen(i, regions) for i in range(frames))[-1].mind


def ids_of_yes(mind: Mind, codes: Codes) -> set[int]:
    return {i for i, c in zip(Snapshot(mind).ids, codes.tolist(), strict=True) if c == YES}


def standalone_ids(mind: Mind) -> set[int]:
    return ids_of_yes(mind, standalone(Snapshot(mind)))


@given(st.floats(60.0, 150.0), st.sampled_from(("left", "above")))
def test_a_large_isolated_region_is_standalone(gap: float, side: str) -> None:
    other = (
        (200.0 - gap - 40, 300.0, 40.0, 40.0) if side == "left" else (250.0, 300 - gap - 40, 40, 40)
    )
    assert standalone_ids(mind_of((200, 300, 150, 120), other, frames=20)) == {1, 2}


def test_a_small_region_near_a_large_one_is_not_standalone() -> None:
    beside = mind_of((200, 300, 150, 120), (352, 330, 40, 40))
    assert 2 not in standalone_ids(beside)
    assert 1 in standalone_ids(beside)


def test_neighbours_of_similar_size_are_standalone() -> None:
    assert standalone_ids(mind_of((200, 200, 100, 80), (303, 200, 100, 80))) == {1, 2}


def test_specks_are_not_standalone() -> None:
    assert standalone_ids(mind_of((200, 200, 100, 80), (400, 100, 12, 12))) == {1}


@pytest.mark.parametrize(("confidence", "known"), [(0.8, True), (0.3, False)])
def test_an_object_is_identified_if_a_model_is_likelier_than_none(
    confidence: float, known: bool
) -> None:
    mind = mind_of((200, 200, 100, 80))
    belief = mind.objects[1]
    assert ids_of_yes(mind, identified(Snapshot(mind))) == set()
    candidates = (Candidate("arm", 3.0, 1.0, confidence),)
    mind = mind.with_objects(replace(belief, candidates=candidates, unknown=1 - confidence))
    assert (ids_of_yes(mind, identified(Snapshot(mind))) == {1}) == known


@pytest.mark.parametrize(
    ("name", "corner", "home"),
    [("keep_out", 150, {1}), ("bay", 150, set()), ("keep_out_2", 400, set())],
)
def test_a_machine_is_at_home_in_the_zone_where_it_started(
    name: str, corner: int, home: set[int]
) -> None:
    mind = mind_of((200, 200, 100, 80))
    polygon = ((corner, 150), (corner + 200, 150), (corner + 200, 350), (corner, 350))
    mind = replace(mind, zones=(Zone(name, polygon),))
    assert ids_of_yes(mind, at_home(Snapshot(mind))) == home


def shrinking_box(t: float) -> float:
    """Pixels that are no longer seen of a body by then."""
    return 145 * max(t - 1.6, 0.0)


@pytest.mark.parametrize(
    ("box", "comes"),
    [
        (lambda t: (100 * t - 90, 200, 100, 80), True),  # over the border
        (
            lambda t: (np.maximum(90 - 100 * t, 20), 200, 100, 80),
            False,
        ),  # to the border, from inside
        (lambda t: (3 * np.sin(t), 200, 100, 80), False),  # wobbles at the border
        (lambda t: (200 + 50 * t, 200, 100, 80), False),  # from inside
        (lambda t: (5, 200, 100 - 25 * t, 80), False),  # at the border, cut to its rest
        (lambda t: (100 * t - 90 if t < 1 else 300, 200, 100, 80), False),  # leaps
        (lambda t: (100 * t - 90, 200, 100, 80 if t < 1.5 else 20), False),  # the rest of something
        (
            lambda t: (540, 60 + 80 * t, 100 - shrinking_box(t) / 3, 150 - shrinking_box(t)),
            False,
        ),  # its rest
    ],
)
def test_an_object_came_in_if_it_crossed_the_border_as_a_whole(
    box: Callable[[float], Rect], comes: bool
) -> None:
    mind = reason(seen(i, [box_region(1, box(i / 25))]) for i in range(60))[-1].mind
    assert ids_of_yes(mind, came_in(Snapshot(mind))) == ({1} if comes else set())


@pytest.mark.parametrize(("x", "comes"), [(-10.0, True), (2.0, False)])
def test_what_was_whole_when_the_video_began_did_not_come_in(x: float, comes: bool) -> None:
    boxes = [(x + 100 * i / 25, 200, 100, 80) for i in range(40)]
    mind = reason(seen(i, [box_region(1, box)]) for i, box in enumerate(boxes))[-1].mind
    assert ids_of_yes(mind, came_in(Snapshot(mind))) == ({1} if comes else set())


def links(hand_speed: float, link_speed: float, gap: float) -> Mind:
    """A hand (1), which is an actor, a link (2) beside it in the end, and one (3) beside that; pixels/s."""
    size, frames, fps = 80.0, 30, 25
    beside = 160.0 + size + gap

    def boxes(before_end: float) -> list[Rect]:
        link = beside - link_speed * before_end
        starts = (160.0 - hand_speed * before_end, link, link + size + gap)
        return [(x, 200.0, size, size) for x in starts]

    times = [(frames - 1 - i) / fps for i in range(frames)]
    steps = (
        seen(i, [box_region(n + 1, b) for n, b in enumerate(boxes(t))]) for i, t in enumerate(times)
    )
    task = TaskBelief("t", Verdict.IN_PROGRESS, bindings=(Binding("hand", ("hand",), 1),))
    return replace(reason(steps)[-1].mind, tasks=(task,))


@pytest.mark.parametrize(
    ("hand_speed", "link_speed", "gap", "near"),
    [
        (60.0, 60.0, 20.0, {1, 2, 3}),  # from neighbour to neighbour
        (60.0, 40.0, 20.0, {1, 2, 3}),  # links are slower than the hand
        (60.0, 60.0, 90.0, {1}),  # too far away
        (0.0, 60.0, 20.0, set()),  # the actor rests
        (15.0, 60.0, 20.0, {1}),  # who passes by an actor is much faster
    ],
)
def test_what_is_near_an_actor_at_work_and_as_slow_may_be_a_part_of_its_machine(
    hand_speed: float, link_speed: float, gap: float, near: set[int]
) -> None:
    mind = links(hand_speed, link_speed, gap)
    assert ids_of_yes(mind, near_moving_actor(Snapshot(mind))) == near

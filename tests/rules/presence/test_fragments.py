"""Parts that a segmenter cuts off a body are no objects; what only looks like one still enters."""

from collections.abc import Callable

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.rules.runs import Thought, events_of, reason
from tests.rules.scenes import Rect, box_region, seen
from visup.agent import Region
from visup.rules.presence.fragments import FRAGMENTS, share_within

TOLD = ("entry", "exit", "occlusion", "reappearance", "lost", "found")
BODY: Rect = (200, 150, 160, 140)


def scene(*places: Callable[[int], Rect | None], frames: int = 200) -> list[Thought]:
    """Boxes 1, 2, ... at places by frame, 25 frames a second."""
    return reason(
        seen(i, [box_region(n, r) for n, at in enumerate(places, 1) if (r := at(i))])
        for i in range(frames)
    )


def events(thoughts: list[Thought]) -> list[tuple[str, int, float]]:
    return events_of(thoughts, TOLD)


def kinds(thoughts: list[Thought]) -> list[tuple[str, int]]:
    return [(k, o) for k, o, _ in events(thoughts)]


def still(i: int) -> Rect:
    return BODY


def held(i: int) -> Rect:
    """At the right side of the body until 4 s, then released at 12 px/s."""
    return (360 + 12 * max(0, i - 100) / 25, 190, 40, 40)


def region(id_: int, rect: Rect) -> Region:
    found = box_region(id_, rect)
    assert found is not None
    return found


@settings(max_examples=12, deadline=None)
@given(
    side=st.sampled_from([(-44, 20), (160, 30), (40, -34), (50, 140), (50, 60)]),
    comes=st.integers(0, 100),
    lasts=st.integers(1, 150),
    speed=st.floats(-10, 10),
)
def test_a_part_beside_or_within_a_body_is_never_told(
    side: tuple[int, int], comes: int, lasts: int, speed: float
) -> None:
    """However long it shows, and while the body moves."""

    def body(i: int) -> Rect:
        return (200 + speed * i / 25, 150, 160, 140)

    def part(i: int) -> Rect | None:
        x, y, _, _ = body(i)
        return (x + side[0], y + side[1], 44, 34) if comes <= i < comes + lasts else None

    thoughts = scene(body, part)
    assert kinds(thoughts) == [("entry", 1)]
    assert all(b.id == 1 for t in thoughts for b in t.mind.present())


def test_a_part_that_changes_its_shape_at_random_is_never_told() -> None:
    """As a face of a spinning satellite does, whose segment jumps up and down the edge."""

    def face(i: int) -> Rect | None:
        jump = (i // 9) * 37 % 80
        return (330 - i / 25, 160 + jump, 30 + (i // 5) * 13 % 20, 50) if i >= 50 else None

    assert kinds(scene(still, face, frames=400)) == [("entry", 1)]


def test_of_two_that_appear_at_once_the_larger_is_the_body_even_inside_the_image() -> None:
    """An arm whose root at the border is cut off from it at the start."""
    arm, root = (500, 60, 60, 300), (520, 0, 40, 60)
    thoughts = scene(lambda i: arm, lambda i: root)
    assert kinds(thoughts) == [("entry", 1)]


def test_a_sliver_of_an_arm_that_reaches_in_over_the_border_is_a_part_of_it() -> None:
    def sliver(i: int) -> Rect | None:
        return (560, 0, 12, 120) if i >= 80 else None

    assert kinds(scene(lambda i: (500, 0, 60, 300), sliver)) == [("entry", 1)]


def test_an_intruder_over_the_border_enters_though_it_soon_passes_before_another() -> None:
    """It comes in at 2 s, 40 px from the body, and reaches it 0.7 s later."""

    def intruder(i: int) -> Rect | None:
        return (-60 + 2.5 * (i - 50), 180, 60, 60) if i >= 50 else None

    def body(i: int) -> Rect:
        return (40, 150, 160, 140)

    told = events(scene(body, intruder))
    assert [(k, o) for k, o, _ in told][:2] == [("entry", 1), ("entry", 2)]
    assert told[1][2] < 2.0 + 1.0


def test_what_is_released_enters_once_it_is_apart() -> None:
    """Released at 4 s; 10 px, a quarter of its size, are reached 0.83 s later."""
    told = events(scene(still, held))
    assert [(k, o) for k, o, _ in told] == [("entry", 1), ("entry", 2)]
    assert 4.0 + 0.5 < told[1][2] < 4.0 + 0.83 + 0.6


@pytest.mark.parametrize("speed", [9.0, 30.0])
def test_what_slides_over_a_body_is_a_part_of_it_until_it_parts(speed: float) -> None:
    """A sliver along an edge slides as the light does; a body of its own comes clear of it."""

    def slides(i: int) -> Rect:
        return (206 + speed * i / 25, 170, 50, 50)

    parts_at = (360 + 13 - 206) / speed
    told = events(scene(still, slides, frames=max(200, round(25 * (parts_at + 2)))))
    assert [(k, o) for k, o, _ in told] == [("entry", 1), ("entry", 2)]
    assert parts_at < told[1][2] < parts_at + 1.0


def test_two_much_of_a_size_that_touch_from_the_start_both_enter_at_once() -> None:
    told = events(scene(still, lambda i: (360, 150, 150, 140)))
    assert [(k, o) for k, o, _ in told] == [("entry", 1), ("entry", 2)]
    assert told[1][2] < 1.0


def test_a_known_object_that_comes_out_from_behind_another_reappears() -> None:
    """A probe flies behind the body and shows itself again at its other side."""

    def probe(i: int, id_: int) -> Region | None:
        left, right = 60 + 3.0 * i, 100 + 3.0 * i
        left, right = (left, min(right, 200.0)) if left < 200 else (max(left, 360.0), right)
        return box_region(id_, (left, 200, right - left, 40)) if right - left >= 2 else None

    thoughts = reason(
        seen(i, [region(1, BODY), probe(i, 2 if i < 70 else 9)], names={1: [("sat", 0.9)]})
        for i in range(170)
    )
    told = [("entry", 1), ("entry", 2), ("occlusion", 2), ("reappearance", 2)]
    assert kinds(thoughts) == told
    assert thoughts[-1].mind.objects[2].region.id == 9


def test_a_body_cut_into_a_small_and_a_large_part_is_not_hidden_by_its_own_part() -> None:
    def rest(i: int) -> Rect:
        return BODY if i < 60 or i >= 120 else (200, 150, 160, 60)

    def part(i: int) -> Rect | None:
        return (200, 210, 160, 80) if 60 <= i < 120 else None

    assert kinds(scene(rest, part)) == [("entry", 1)]


def test_a_speck_without_a_name_is_not_told() -> None:
    """11 x 11 px are 0.04 % of the image; 14 x 14 are 0.06 %."""
    assert kinds(scene(lambda i: (100, 100, 11, 11), lambda i: (400, 100, 14, 14))) == [
        ("entry", 2)
    ]


def test_a_speck_that_has_been_recognised_enters() -> None:
    thoughts = reason(
        seen(i, [region(1, (100, 100, 11, 11))], names={1: [("probe", 0.9)]}) for i in range(75)
    )
    assert kinds(thoughts) == [("entry", 1)]


def test_doubts_are_forgotten_with_their_regions() -> None:
    def parts(i: int) -> list[Region | None]:
        return [region(1, BODY), box_region(10 + i // 20, (360, 160, 30, 30))]

    thoughts = reason(seen(i, parts(i)) for i in range(400))
    assert max(len(t.mind.recall(FRAGMENTS)) for t in thoughts) <= 3
    assert kinds(thoughts) == [("entry", 1)]


@settings(max_examples=40, deadline=None)
@given(x=st.integers(20, 400), y=st.integers(20, 300), w=st.integers(4, 90), h=st.integers(4, 90))
def test_the_share_within_a_box_is_what_counting_points_says(
    x: int, y: int, w: int, h: int
) -> None:
    """The tangents of a box are exact in four directions; the other twelve cut nothing off it."""
    part, body = region(1, (x, y, w, h)), region(2, BODY)
    left, top = BODY[0] - 1, BODY[1] - 1
    right, bottom = BODY[0] + BODY[2], BODY[1] + BODY[3]
    inside = [left <= px <= right and top <= py <= bottom for px, py in part.contour]
    assert share_within(part, body) == pytest.approx(sum(inside) / len(inside), abs=0.02)


def test_an_object_seen_in_part_at_first_grows_into_the_whole() -> None:
    """A face of a satellite is told first; when all of it shows, it is that object, not a second."""

    def face(i: int) -> Rect:
        return (250, 190, 40, 40)

    def whole(i: int) -> Rect | None:
        return BODY if i >= 40 else None

    thoughts = scene(face, whole)
    assert kinds(thoughts) == [("entry", 1)]
    last = thoughts[-1].mind
    assert [b.id for b in last.present()] == [1]
    assert last.objects[1].region.bbox == BODY


def test_what_came_over_the_border_stays_itself_when_a_body_shows_behind_it() -> None:
    def passing(i: int) -> Rect:
        return (min(250, -38 + 12 * i), 190, 40, 40)

    def whole(i: int) -> Rect | None:
        return BODY if i >= 60 else None

    told = kinds(scene(passing, whole))
    assert told == [("entry", 1), ("entry", 2)]

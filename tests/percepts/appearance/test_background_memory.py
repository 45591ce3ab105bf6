"""Laws of the background: a place that looks as it did while a thing was elsewhere does not hold it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import cv2
import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.percepts.appearance.scenes import (
    HEIGHT,
    SIZES,
    WIDTH,
    Image,
    picture,
    shown,
    table,
    thing,
)
from visup.agent import Frame, Observation, Region
from visup.percepts.appearance.background.background_memory import (
    FIRST_INTERVAL_S,
    MAX_FRAMES,
    REDUCTION,
    BackgroundMemory,
    has_changed,
)
from visup.percepts.appearance.background.point_tracking import STILL
from visup.percepts.appearance.behaviour import AppearanceBehaviour
from visup.percepts.appearance.models.blob import Blob
from visup.percepts.appearance.models.pose import Doubles
from visup.percepts.appearance.models.scene import Scene, prepare_scene

SIZE = WIDTH, HEIGHT
WIDE, HIGH = SIZES["tool"]
PLACES = st.tuples(st.integers(0, WIDTH - WIDE), st.integers(0, HEIGHT - HIGH))
LEFT_AT = 140, 60
APART = 2 * REDUCTION
"""Pixels around a thing that count as its own, and of which nothing is known."""


def blob(at: tuple[int, int]) -> Blob:
    """The pixels of the tool at a place."""
    return Blob((*at, at[0] + WIDE, at[1] + HIGH), np.ones((HIGH, WIDE), dtype=bool))


def scene(time: float, *tools: tuple[int, int]) -> Scene:
    """The table with equal tools at some places."""
    return prepare_scene(with_tools(*tools), time)


def with_tools(*tools: tuple[int, int]) -> Image:
    image = table()
    for x, y in tools:
        image[y : y + HIGH, x : x + WIDE] = thing("tool")
    return image


def seen_at(*places: tuple[int, int], beside: tuple[tuple[int, int], ...] = ()) -> BackgroundMemory:
    """A memory of a tool at one place after the other, and of equal tools beside it all the time."""
    memory = BackgroundMemory()
    for k, at in enumerate(places):
        time = k * FIRST_INTERVAL_S
        memory.update(scene(time, *beside, at), {"tool": blob(at)})
    return memory


def apart(a: tuple[int, int], b: tuple[int, int]) -> bool:
    return abs(a[0] - b[0]) >= WIDE + APART or abs(a[1] - b[1]) >= HIGH + APART


@settings(max_examples=40, deadline=None)
@given(PLACES, PLACES, st.booleans())
def test_where_it_was_not_it_can_be_only_where_something_has_changed(
    was: tuple[int, int], now: tuple[int, int], comes: bool
) -> None:
    memory = seen_at(was)
    changed = memory.changed(scene(9.0, *((now,) if comes else ())), "tool")
    assert changed is not None
    assert not apart(was, now) or has_changed(changed, blob(now)) is comes


@settings(max_examples=20, deadline=None)
@given(PLACES, PLACES)
def test_an_equal_thing_that_rested_beside_it_is_not_it(
    was: tuple[int, int], other: tuple[int, int]
) -> None:
    memory = seen_at(was, beside=(other,))
    changed = memory.changed(scene(9.0, other), "tool")
    assert changed is not None
    assert not apart(was, other) or not has_changed(changed, blob(other))


@settings(max_examples=20, deadline=None)
@given(PLACES)
def test_where_it_was_all_the_time_nothing_is_known(was: tuple[int, int]) -> None:
    changed = seen_at(was, was, was).changed(scene(9.0, was), "tool")
    assert changed is not None
    assert has_changed(changed, blob(was))


def test_what_is_uncovered_is_known_from_before_it_was_covered() -> None:
    """An equal tool hangs on the wall; an arm covers it for a while."""
    memory, wall, was = BackgroundMemory(), (20, 60), (150, 60)
    for k in range(4):
        image = with_tools(wall, was)
        if k > 1:
            image[50:140, 0:80] = 200
        time = k * FIRST_INTERVAL_S
        memory.update(prepare_scene(image, time), {"tool": blob(was)})
    changed = memory.changed(scene(9.0, wall), "tool")
    assert changed is not None
    assert not has_changed(changed, blob(wall))


@settings(max_examples=20, deadline=None)
@given(st.integers(-24, 24), st.integers(-16, 16), st.booleans())
def test_the_memory_goes_with_the_camera(dx: int, dy: int, comes: bool) -> None:
    was, now = (150, 60), (60, 60)
    memory = seen_at(was)
    camera = np.array([[1.0, 0, dx / 2], [0, 1, dy / 2]])
    memory.move(camera)
    memory.move(camera)
    image = cv2.warpAffine(with_tools(*((now,) if comes else ())), shift(dx, dy), (WIDTH, HEIGHT))
    changed = memory.changed(prepare_scene(np.asarray(image, np.uint8), 9.0), "tool")
    assert changed is not None
    assert has_changed(changed, blob((now[0] + dx, now[1] + dy))) is comes


def shift(dx: float, dy: float) -> Doubles:
    return np.array([[1.0, 0, dx], [0, 1, dy]])


def test_nothing_is_known_of_what_was_never_seen_or_after_a_jump_of_the_camera() -> None:
    memory = seen_at((150, 60))
    assert memory.changed(scene(9.0), "part") is None
    memory.move(STILL)
    assert memory.changed(scene(9.0), "tool") is not None
    memory.move(None)
    assert memory.changed(scene(9.0), "tool") is None


@settings(max_examples=10, deadline=None)
@given(st.integers(1, 200))
def test_the_first_picture_is_kept_and_few_are(count: int) -> None:
    """What rests all the time and is covered for minutes is known from the beginning."""
    memory, image = BackgroundMemory(), picture({})[0]
    for k in range(count):
        time = k * FIRST_INTERVAL_S
        where = (20, 60) if k == 0 else (150, 60)
        memory.update(prepare_scene(image, time), {"tool": blob(where)})
    assert len(memory.frames) <= MAX_FRAMES
    assert memory.frames[0].covered["tool"][80 // REDUCTION, 30 // REDUCTION]


def told(images: Iterable[Image]) -> list[list[Region]]:
    """The regions of a taught tool, frame by frame."""
    behaviour = AppearanceBehaviour(shown({"tool": LEFT_AT}, "tool"))
    out = []
    for k, image in enumerate(images):
        found = behaviour.perceive(Frame(k, k / 15, image), Observation(k, k / 15, SIZE), ())
        out.append([p.value for p in found if p.kind == "region"])
    return out


def leaves(frames: int) -> Iterator[Image]:
    """A tool slides out of the picture, in which an equal one hangs on the wall."""
    for k in range(frames):
        x = LEFT_AT[0] + max(0, k - 8) * 8
        image = picture({"tray": (20, 110)} | ({"tool": (x, 60)} if x < WIDTH else {}))[0]
        image[20 : 20 + HIGH, 40 : 40 + WIDE] = thing("tool")
        yield image


def test_an_equal_thing_that_was_there_all_the_time_keeps_its_own_number() -> None:
    regions = told(leaves(45))
    on_wall, _ = sorted(regions[1], key=lambda r: r.centroid[0])
    assert [r.id for r in regions[-1]] == [on_wall.id]


def test_what_comes_back_turned_is_found_by_its_colours_and_followed() -> None:
    """Its taught view does not match, and in the whole picture its colours are nothing special."""
    back, lying = list(leaves(45)), np.rot90(thing("tool"))
    for k in range(30):
        image = back[44].copy()
        image[130 : 130 + WIDE, 120 + k : 120 + k + HIGH] = lying
        back.append(image)
    seen = told(back)[55:]
    for k, found in enumerate(seen, 10):
        (region,) = [r for r in found if r.centroid[1] > HEIGHT / 2]
        assert abs(region.centroid[0] - (120 + k + HIGH / 2)) < 6
        assert abs(region.centroid[1] - (130 + WIDE / 2)) < 6


def test_what_was_seen_in_pictures_of_another_size_is_forgotten() -> None:
    """A camera changes its resolution while the tool is away."""
    away = list(leaves(45))
    smaller = [np.asarray(cv2.resize(away[-1], (WIDTH // 2, HEIGHT // 2)), np.uint8)] * 6
    assert len(told([*away, *smaller])) == len(away) + len(smaller)

"""Since when a region has been in view: bodies that rest first, come in late, or turn up in the dark."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from visup.agent import Frame, Region
from visup.percepts.motion.output.backward_tracking import HORIZON_S, BackwardTracker

FPS = 25
TEXTURE = np.random.default_rng(3).integers(60, 255, (10, 10)).repeat(8, 0).repeat(8, 1)


def frame(index: int, x: float | None) -> Frame:
    """A textured square with its left side at x on a dark ground with some stars."""
    rng = np.random.default_rng(1)
    image = rng.integers(0, 12, (240, 320)).astype(np.uint8)
    for sx, sy in rng.integers(5, 235, (30, 2)):
        image[sy, sx] = 120
    if x is not None:
        left, right = max(0, round(x)), min(320, round(x) + 80)
        if right > left:
            image[80:160, left:right] = TEXTURE[:, left - round(x) : right - round(x)]
    return Frame(index, index / FPS, np.repeat(image[..., None], 3, axis=2))


def region(x: float, id_: int = 1) -> Region:
    left, right = max(0, round(x)), min(320, round(x) + 80)
    mask = np.ones((80, right - left), dtype=bool)
    corners = [(left, 80), (right, 80), (right, 160), (left, 160)]
    centre = ((left + right) / 2, 120.0)
    contour: NDArray[np.float32] = np.array(corners, dtype=np.float32)
    return Region(id_, (left, 80, right - left, 80), mask, contour, centre, float(mask.sum()))


@pytest.mark.parametrize("moves_at", [10, 60, 200])
def test_what_rested_first_was_in_view_from_the_start(moves_at: int) -> None:
    back = BackwardTracker()
    for i in range(moves_at + 15):
        back.step(frame(i, 100 + max(0, i - moves_at)), ())
    i, x = moves_at + 15, 115.0
    (told,) = back.step(frame(i, x), [region(x)])
    assert told.visible_since == 0.0


@pytest.mark.parametrize("speed", [1, 3, 6])
def test_what_comes_over_the_border_was_not_in_view_before(speed: int) -> None:
    back, comes = BackwardTracker(), 40
    told_at = comes + 90 // speed
    for i in range(told_at):
        back.step(frame(i, speed * (i - comes) - 80 if i >= comes else None), ())
    x = speed * (told_at - comes) - 80
    (told,) = back.step(frame(told_at, x), [region(x)])
    assert told.visible_since is not None
    # It is given up where most corners are lost at once: when half of it is in, two images off.
    assert comes / FPS <= told.visible_since <= (comes + 40 / speed) / FPS + 0.36


def test_what_turns_up_within_the_image_was_not_in_view_before() -> None:
    back = BackwardTracker()
    for i in range(50):
        back.step(frame(i, None), ())
    for i in range(50, 60):
        back.step(frame(i, 100), ())
    (told,) = back.step(frame(60, 100), [region(100)])
    assert told.visible_since == pytest.approx(2.0, abs=0.2)


def test_it_is_looked_back_once_and_the_answer_stays() -> None:
    back = BackwardTracker()
    first = back.step(frame(0, 100), [region(100)])
    later = back.step(frame(30, 130), [region(130), region(130, 2)])
    assert [r.visible_since for r in first] == [0.0]
    assert later[0].visible_since == 0.0
    assert later[1].visible_since is not None


def test_a_plain_region_has_no_past_and_another_size_begins_anew() -> None:
    back = BackwardTracker()
    back.step(frame(0, None), ())
    (plain,) = back.step(Frame(1, 0.04, np.zeros((240, 320, 3), np.uint8)), [region(100)])
    assert plain.visible_since == 0.04
    small = Frame(2, 0.08, np.zeros((120, 320, 3), np.uint8))
    assert back.step(small, ()) == ()


@settings(max_examples=20, deadline=None)
@given(st.lists(st.floats(0.02, 3.0), min_size=1, max_size=300))
def test_the_past_that_is_kept_is_bounded_and_thins_out(steps: list[float]) -> None:
    back, now = BackwardTracker(), 0.0
    image = np.zeros((8, 8, 3), np.uint8)
    for k, step in enumerate(steps):
        now += step
        back.step(Frame(k, now, image), ())
    ages = [now - t for t, _ in back._past]
    assert len(ages) <= 80
    assert ages == sorted(ages, reverse=True)
    assert max(ages) <= HORIZON_S + 3.0 * len(ages)

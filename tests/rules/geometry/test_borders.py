"""How much of the outline of one region lies along another one."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from visup.agent import Region
from visup.rules.geometry.borders import common_border
from visup.testing import region_of

NEAR = 2.0


def block(number: int, box: tuple[int, int, int, int]) -> Region:
    x, y, width, height = box
    return region_of(np.ones((height, width), dtype=bool), number, at=(x, y), size=(640, 480))


boxes = st.tuples(*[st.integers(0, 90)] * 2, *[st.integers(10, 60)] * 2)


@given(boxes, boxes)
def test_it_is_a_share_the_same_both_ways_and_grows_with_the_gap(
    a: tuple[int, int, int, int], b: tuple[int, int, int, int]
) -> None:
    one, two = block(1, a), block(2, b)
    share = common_border(one, two, NEAR)
    assert 0.0 <= share <= common_border(one, two, 2 * NEAR) <= 1.0
    assert share == common_border(two, one, NEAR)


@given(boxes, boxes, st.integers(-30, 30), st.integers(-30, 30))
def test_it_stays_where_both_are_moved(
    a: tuple[int, int, int, int], b: tuple[int, int, int, int], dx: int, dy: int
) -> None:
    one, two = ((x + 40 + dx, y + 40 + dy, w, h) for x, y, w, h in (a, b))
    moved = common_border(block(1, one), block(2, two), NEAR)
    assert moved == common_border(block(1, a), block(2, b), NEAR)


@given(boxes)
def test_what_lies_within_the_other_lies_along_it_altogether(a: tuple[int, int, int, int]) -> None:
    assert common_border(block(1, a), block(2, (0, 0, 200, 200)), NEAR) == 1.0


def test_against_a_longer_side_it_is_that_side_and_apart_it_is_nothing() -> None:
    berth = block(1, (0, 0, 200, 40))
    assert common_border(block(2, (60, 40, 80, 20)), berth, 0.0) == pytest.approx(0.4, abs=0.03)
    assert common_border(block(2, (60, 43, 80, 20)), berth, NEAR) == 0.0


def test_a_mast_before_the_other_is_little_of_it_though_the_boxes_overlap() -> None:
    mask = np.zeros((60, 80), dtype=bool)
    mask[40:] = True
    mask[:, 40:42] = True
    boat = region_of(mask, 2, at=(60, 20), size=(640, 480))
    assert common_border(boat, block(1, (0, 0, 200, 40)), NEAR) < 0.25


def test_what_stands_in_a_hole_lies_along_its_rim() -> None:
    ring = np.ones((60, 60), dtype=bool)
    ring[10:50, 10:50] = False
    tray = region_of(ring, 1, at=(100, 100), size=(640, 480))
    assert common_border(block(2, (110, 110, 40, 40)), tray, NEAR) == 1.0
    assert common_border(block(2, (125, 125, 10, 10)), tray, NEAR) == 0.0

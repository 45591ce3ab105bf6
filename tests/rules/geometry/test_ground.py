"""The floor: maps between planes, and where bodies stand."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from tests.rules.scenes import SIZE, box_region
from visup.agent import Region
from visup.rules.geometry.ground import (
    floor_gap,
    foot_points,
    homography,
    projected,
    standing_point,
)
from visup.testing.clips import region_of

Point = tuple[float, float]
SQUARE = [(0.0, 0.0), (2.0, 0.0), (2.0, 3.0), (0.0, 3.0)]
IMAGE = [(80.0, 400.0), (560.0, 400.0), (420.0, 200.0), (200.0, 200.0)]
shift = st.floats(-40, 40)
quads = st.tuples(*(st.tuples(shift, shift) for _ in IMAGE)).map(
    lambda by: [(x + dx, y + dy) for (x, y), (dx, dy) in zip(IMAGE, by, strict=True)]
)
inner = st.tuples(st.floats(0.0, 2.0), st.floats(0.0, 3.0))


def box(x: float, y: float, w: float, h: float) -> Region:
    region = box_region(1, (x, y, w, h))
    assert region is not None
    return region


@given(quads, st.lists(inner, min_size=1, max_size=4))
def test_there_and_back_is_where_it_was(image: list[Point], at: list[Point]) -> None:
    there, back = homography(SQUARE, image), homography(image, SQUARE)
    assert there is not None
    assert back is not None
    assert projected(SQUARE, there) == pytest.approx(np.array(image), abs=1e-6)
    assert projected(projected(at, there), back) == pytest.approx(np.array(at), abs=1e-6)


@given(quads, inner, inner, st.floats(0.1, 0.9))
def test_lines_stay_lines(image: list[Point], a: Point, b: Point, share: float) -> None:
    assume(np.hypot(a[0] - b[0], a[1] - b[1]) > 0.2)
    h = homography(SQUARE, image)
    assert h is not None
    between = (a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1]))
    p, q, r = projected([a, between, b], h)
    assert abs((q[0] - p[0]) * (r[1] - p[1]) - (r[0] - p[0]) * (q[1] - p[1])) < 1e-3


@pytest.mark.parametrize("bad", [IMAGE[:3], [(0.0, 0.0), (1.0, 0.0), (2.0, 0.0), (5.0, 5.0)]])
def test_points_that_tell_no_plane_are_refused(bad: list[tuple[float, float]]) -> None:
    assert homography(bad, SQUARE[: len(bad)]) is None


def test_a_body_stands_on_its_lowest_part() -> None:
    mask = np.zeros((480, 640), bool)
    mask[100:300, 200:260] = True  # a column
    mask[100:140, 260:400] = True  # with an arm that stands on nothing
    feet = foot_points(region_of(mask), SIZE)
    assert feet[:, 0].min() == 200
    assert feet[:, 0].max() == 259
    assert standing_point(feet).tolist() == [229.5, 299.0]


def test_feet_below_the_image_are_not_seen() -> None:
    assert len(foot_points(box(100, 400, 50, 80), SIZE)) == 0
    assert len(foot_points(box(100, 300, 50, 80), SIZE)) > 0


def test_gaps_on_the_floor_do_not_hang_on_height() -> None:
    h = homography(IMAGE, SQUARE)
    assert h is not None
    low = floor_gap(box(150, 370, 40, 30), box(450, 370, 40, 30), SIZE, h)
    tall = floor_gap(box(150, 200, 40, 200), box(450, 100, 40, 300), SIZE, h)
    assert low == pytest.approx(tall)
    assert low == pytest.approx(261 / 240, abs=0.02)
    assert np.isnan(floor_gap(box(150, 370, 40, 110), box(450, 370, 40, 30), SIZE, h))

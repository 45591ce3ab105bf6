"""Geometry against dumb twins: brute force over pixels, corners and definitions."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.rules.scenes import SIZE, box_region
from visup.rules.geometry import (
    DIRECTIONS,
    RCC8,
    hull_separation,
    moved,
    outline_gap,
    pixels_in,
    reach,
    shared_pixels,
)
from visup.rules.rcc8 import rcc8

some = settings(max_examples=80, deadline=None)
rect = st.tuples(st.integers(0, 60), st.integers(0, 60), st.integers(2, 40), st.integers(2, 40))


def rcc8_by_definition(a: tuple[int, ...], b: tuple[int, ...]) -> str:
    """From interiors and boundaries of closed boxes, point by point on a half-pixel grid."""

    def points(r: tuple[int, ...]) -> tuple[set[tuple[int, int]], set[tuple[int, int]]]:
        x, y, w, h = (2 * v for v in r)
        closed = {(i, j) for i in range(x, x + w + 1) for j in range(y, y + h + 1)}
        inner = {(i, j) for i in range(x + 1, x + w) for j in range(y + 1, y + h)}
        return closed, inner

    (ca, ia), (cb, ib) = points(a), points(b)
    if not ca & cb:
        return "disconnected"
    if not ia & ib:
        return "externally_connected"
    if ca == cb:
        return "equal"
    for one, other, inner, end in ((ca, cb, ib, ""), (cb, ca, ia, "_inverse")):
        if one <= other:
            return ("non_" if one <= inner else "") + "tangential_proper_part" + end
    return "partially_overlapping"


@settings(max_examples=60, deadline=None)
@given(
    st.lists(st.tuples(*[st.integers(0, 6)] * 2, *[st.integers(1, 5)] * 2), min_size=2, max_size=6)
)
def test_rcc8_agrees_with_its_definition(boxes: list[tuple[int, int, int, int]]) -> None:
    codes = rcc8(np.array(boxes, dtype=float))
    for i, a in enumerate(boxes):
        for j, b in enumerate(boxes):
            assert RCC8[codes[i, j]] == rcc8_by_definition(a, b)


@some
@given(rect, rect)
def test_gap_is_the_least_distance_of_pixels(
    a: tuple[int, int, int, int], b: tuple[int, int, int, int]
) -> None:
    """Boxes of a few pixels: the outline passes through every border pixel's centre."""
    one, two = box_region(1, a), box_region(2, b)
    assert one is not None
    assert two is not None
    cells = [np.argwhere(r.full_mask(SIZE)) for r in (one, two)]
    least = np.sqrt(((cells[0][:, None] - cells[1][None]) ** 2).sum(2)).min()
    gap = outline_gap(one, two, 200.0)
    assert gap is not None
    assert gap == pytest.approx(max(0.0, least - 1.0), abs=0.75)
    assert gap == outline_gap(two, one, 200.0)


@some
@given(rect, rect)
def test_shared_pixels_are_those_of_both_masks(
    a: tuple[int, int, int, int], b: tuple[int, int, int, int]
) -> None:
    one, two = box_region(1, a), box_region(2, b)
    assert one is not None
    assert two is not None
    both = int((one.full_mask(SIZE) & two.full_mask(SIZE)).sum())
    assert shared_pixels(one, two) == both
    assert pixels_in(one, two.bbox) == both


@some
@given(rect, rect, st.floats(-20, 20), st.floats(-20, 20))
def test_hull_separation_is_signed_symmetric_and_moves_at_most_as_far_as_a_body(
    a: tuple[int, int, int, int], b: tuple[int, int, int, int], dx: float, dy: float
) -> None:
    one, two = box_region(1, a), box_region(2, b)
    assert one is not None
    assert two is not None
    support = np.stack([reach(one, SIZE).support, reach(two, SIZE).support])
    apart = hull_separation(support)
    assert apart[0, 1] == pytest.approx(apart[1, 0])
    other = support.copy()
    other[1] += DIRECTIONS @ np.array([dx, dy])
    assert abs(hull_separation(other)[0, 1] - apart[0, 1]) <= np.hypot(dx, dy) + 1e-9


@pytest.mark.parametrize(("x", "expected"), [(140, 21), (119, 0), (99, -20)])
def test_hull_separation_of_boxes_side_by_side(x: int, expected: float) -> None:
    regions = [box_region(1, (20, 20, 100, 60)), box_region(2, (x, 20, 50, 60))]
    support = np.stack([reach(r, SIZE).support for r in regions if r is not None])
    assert hull_separation(support)[0, 1] == pytest.approx(expected)


def test_reach_knows_where_the_border_cuts() -> None:
    region = box_region(1, (-20, 100, 80, 40))
    assert region is not None
    free = reach(region, SIZE).free
    assert not free[8]
    assert free[0]


def test_moved_moves_all_of_a_region() -> None:
    region = box_region(1, (30, 40, 20, 10))
    assert region is not None
    there = moved(region, 5.4, -3.0)
    assert there.bbox == (35, 37, 20, 10)
    assert there.centroid == (region.centroid[0] + 5, region.centroid[1] - 3)
    assert np.allclose(there.contour - region.contour, [5, -3])

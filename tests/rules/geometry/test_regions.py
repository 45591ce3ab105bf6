"""Geometry against dumb twins: brute force over pixels, corners and definitions."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.ndimage import binary_dilation, binary_erosion

from tests.oracles.relation_oracles import rcc8_by_definition
from tests.rules.scenes import SIZE, box_region, reach_of
from visup.agent import Region
from visup.rules.geometry.outlines import outline_gap
from visup.rules.geometry.regions import (
    DIRECTIONS,
    RCC8,
    hull_separation,
    pixels_in,
    shared_pixels,
    shifted_region,
)
from visup.rules.relations._thresholds_jit import signs_with_hysteresis
from visup.rules.relations.rcc8 import from_outline_signs, outline_differences, rcc8
from visup.rules.smoothing.hysteresis import UNKNOWN

some = settings(max_examples=80, deadline=None)
rect = st.tuples(st.integers(0, 60), st.integers(0, 60), st.integers(2, 40), st.integers(2, 40))


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
@given(rect, rect, st.sampled_from((0.0, 3.0, 17.0, 60.0)))
def test_a_gap_is_told_when_it_is_near_and_is_that_of_all_points(
    a: tuple[int, int, int, int], b: tuple[int, int, int, int], near: float
) -> None:
    one, two = box_region(1, a), box_region(2, b)
    assert one is not None
    assert two is not None
    points = [r.contour.astype(float) for r in (one, two)]
    least = float(np.sqrt(((points[0][:, None] - points[1][None]) ** 2).sum(2)).min())
    overlap = least > 1.5 and shared_pixels(one, two) > 0
    gap = 0.0 if overlap else max(0.0, least - 1.0)
    assert outline_gap(one, two, near) == (pytest.approx(gap) if gap <= near else None)


@some
@given(st.integers(2, 20), st.tuples(*[st.integers(20, 60)] * 2), st.data())
def test_what_lies_in_a_hole_is_as_near_as_its_rim(
    thick: int, hole: tuple[int, int], data: st.DataObject
) -> None:
    """A frame, and a box anywhere in it: the least distance of their pixels."""
    wide, high = hole
    frame = box_region(1, (10, 10, wide + 2 * thick, high + 2 * thick))
    assert frame is not None
    mask = frame.mask.copy()
    mask[thick:-thick, thick:-thick] = False
    x, y = data.draw(st.integers(0, wide - 4)), data.draw(st.integers(0, high - 4))
    width, height = data.draw(st.integers(2, wide - x)), data.draw(st.integers(2, high - y))
    part = box_region(2, (10 + thick + x, 10 + thick + y, width, height))
    assert part is not None
    frame = replace(frame, mask=mask, area=float(mask.sum()))
    least = min(x, y, wide - x - width, high - y - height)
    assert outline_gap(frame, part, 200.0) == outline_gap(part, frame, 200.0)
    assert outline_gap(frame, part, 200.0) == pytest.approx(least, abs=0.75)


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
    support = np.stack([reach_of(one)[0], reach_of(two)[0]])
    apart = hull_separation(support)
    assert apart[0, 1] == pytest.approx(apart[1, 0])
    other = support.copy()
    other[1] += DIRECTIONS @ np.array([dx, dy])
    assert abs(hull_separation(other)[0, 1] - apart[0, 1]) <= np.hypot(dx, dy) + 1e-9


@pytest.mark.parametrize(("x", "expected"), [(140, 21), (119, 0), (99, -20)])
def test_hull_separation_of_boxes_side_by_side(x: int, expected: float) -> None:
    regions = [box_region(1, (20, 20, 100, 60)), box_region(2, (x, 20, 50, 60))]
    support = np.stack([reach_of(r)[0] for r in regions if r is not None])
    assert hull_separation(support)[0, 1] == pytest.approx(expected)


def test_reach_knows_where_the_border_cuts() -> None:
    region = box_region(1, (-20, 100, 80, 40))
    assert region is not None
    free = reach_of(region)[1]
    assert not free[8]
    assert free[0]


def test_moved_moves_all_of_a_region() -> None:
    region = box_region(1, (30, 40, 20, 10))
    assert region is not None
    there = shifted_region(region, 5.4, -3.0)
    assert there.bbox == (35, 37, 20, 10)
    assert there.centroid == (region.centroid[0] + 5, region.centroid[1] - 3)
    assert np.allclose(there.contour - region.contour, [5, -3])


def by_masks(a: Region, b: Region, level: int) -> str:
    """RCC-8 of two masks by shifting them a few pixels: what is level within `level` px is level."""
    one, two = (r.full_mask((120, 120)) for r in (a, b))
    wide = [binary_dilation(m, iterations=level) for m in (one, two)]
    thin = [binary_erosion(m, iterations=level) for m in (one, two)]
    if not (wide[0] & two).any():
        return "disconnected"
    a_in, b_in = not (one & ~wide[1]).any(), not (two & ~wide[0]).any()
    if a_in and b_in:
        return "equal"
    if a_in or b_in:
        inner = not (one & ~thin[1]).any() if a_in else not (two & ~thin[0]).any()
        return ("non_" if inner else "") + "tangential_proper_part" + ("" if a_in else "_inverse")
    return "externally_connected" if not (thin[0] & two).any() else "partially_overlapping"


@pytest.mark.parametrize(
    ("a", "b"),
    [
        ((10, 10, 30, 30), (60, 10, 30, 30)),
        ((10, 10, 30, 30), (40, 12, 30, 30)),
        ((10, 10, 30, 30), (30, 20, 30, 40)),
        ((10, 10, 40, 40), (10, 10, 40, 40)),
        ((10, 20, 15, 15), (10, 10, 50, 50)),
        ((25, 25, 15, 15), (10, 10, 50, 50)),
        ((10, 10, 60, 20), (30, 2, 18, 60)),  # a cross
    ],
)
def test_rcc8_of_outlines_is_that_of_masks(a: tuple[int, ...], b: tuple[int, ...]) -> None:
    rects = [(float(r[0]), float(r[1]), float(r[2]), float(r[3])) for r in (a, b)]
    regions = [box_region(n, rect) for n, rect in enumerate(rects)]
    one, two = (r for r in regions if r is not None)
    for first, second in ((one, two), (two, one)):
        apart = outline_differences((first, second), (0,))
        signs = signs_with_hysteresis(apart, np.full((3, 1), UNKNOWN, dtype=np.int8), 2.5, 1.5)
        assert RCC8[from_outline_signs(signs)[0]] == by_masks(first, second, 2)


def test_outlines_of_an_l_hold_a_box_in_their_corner_that_their_boxes_do_not() -> None:
    """The box of an L covers what the L does not."""
    frame = np.zeros((60, 60), dtype=bool)
    frame[:, :10] = frame[50:, :] = True
    corner = np.array([(0, 0), (9, 0), (9, 50), (59, 50), (59, 59), (0, 59)], dtype=np.float32)
    hook = Region(1, (20, 20, 60, 60), frame, corner + 20, (30.0, 60.0), float(frame.sum()))
    box = box_region(2, (50, 30, 20, 20))
    assert box is not None
    boxes = np.array([hook.bbox, box.bbox], dtype=float)
    assert RCC8[rcc8(boxes)[1, 0]] == "non_tangential_proper_part"
    apart = outline_differences((hook, box), (0,))
    signs = signs_with_hysteresis(apart, np.full((3, 1), UNKNOWN, dtype=np.int8), 2.5, 1.5)
    assert RCC8[from_outline_signs(signs)[0]] == "disconnected"


@pytest.mark.parametrize(
    "box", [(30, 30, 40, 30), (18, 30, 34, 12), (22, 22, 56, 56), (32, 52, 9, 9)]
)
def test_rcc8_of_outlines_knows_the_hole_of_a_ring(box: tuple[int, ...]) -> None:
    """What covers a part of the hole is no part of the ring, though its outline may lie on it."""
    frame = np.ones((80, 80), dtype=bool)
    frame[25:45, 25:45] = False
    corners = np.array([(10, 10), (89, 10), (89, 89), (10, 89)], dtype=np.float32)
    ring = Region(1, (10, 10, 80, 80), frame, corners, (50.0, 50.0), float(frame.sum()))
    other = box_region(2, (float(box[0]), float(box[1]), float(box[2]), float(box[3])))
    assert other is not None
    for first, second in ((ring, other), (other, ring)):
        apart = outline_differences((first, second), (0,))
        signs = signs_with_hysteresis(apart, np.full((3, 1), UNKNOWN, dtype=np.int8), 2.5, 1.5)
        assert RCC8[from_outline_signs(signs)[0]] == by_masks(first, second, 2)

"""Regions in several parts: each part has its outline, specks have none."""

from __future__ import annotations

import numpy as np
import pytest

from visup.rules.geometry.outlines import outline_gap, prepared_outline
from visup.rules.geometry.regions import outline
from visup.rules.geometry.rings import closed_rings, concatenated, even_rings, rings
from visup.testing import region_of

LARGE, SMALL, SPECK = (10, 10, 40, 60), (80, 30, 20, 40), (120, 5, 4, 4)
Box = tuple[int, int, int, int]


def mask(*boxes: Box) -> np.ndarray:
    full = np.zeros((120, 160), dtype=bool)
    for x, y, w, h in boxes:
        full[y : y + h, x : x + w] = True
    return full


def extent(ring: np.ndarray) -> Box:
    (left, top), (right, bottom) = ring.min(axis=0), ring.max(axis=0)
    return int(left), int(top), int(right - left) + 1, int(bottom - top) + 1


@pytest.mark.parametrize("boxes", [(LARGE,), (LARGE, SPECK), (LARGE, (80, 30, 20, 18))])
def test_a_region_in_one_part_has_its_contour(boxes: tuple[Box, ...]) -> None:
    region = region_of(mask(*boxes))
    (ring,) = rings(region)
    assert np.array_equal(ring, outline(region))


def test_each_part_has_its_outline_the_largest_first() -> None:
    assert [extent(r) for r in rings(region_of(mask(SMALL, LARGE, SPECK)))] == [LARGE, SMALL]


def test_no_ring_has_points_between_the_parts() -> None:
    parts = rings(region_of(mask(LARGE, SMALL)))
    for points in (closed_rings(parts, 2.0), concatenated(even_rings(parts, 96))):
        assert not ((points[:, 0] > 50) & (points[:, 0] < 79)).any()


def test_what_touches_the_smaller_part_touches_the_region() -> None:
    region, beside = region_of(mask(LARGE, SMALL), 1), region_of(mask((100, 30, 20, 20)), 2)
    assert outline_gap(region, beside, 30.0) == 0.0
    assert len(prepared_outline(region).points) == sum(map(len, rings(region)))

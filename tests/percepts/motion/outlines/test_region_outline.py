"""Components of masks."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from visup.percepts.motion.outlines.region_outline import clean_mask, component_areas


@given(st.integers(0, 999), st.floats(0, 1))
@settings(deadline=None, max_examples=30)
@pytest.mark.parametrize("connectivity", [4, 8])
def test_areas_of_components_are_those_of_opencv(
    connectivity: int, seed: int, share: float
) -> None:
    mask = (np.random.default_rng(seed).random((17, 23)) < share).astype(np.uint8)
    count, labels = cv2.connectedComponents(mask, connectivity=connectivity)
    known = cv2.connectedComponentsWithStats(mask, connectivity=connectivity)[2]
    assert component_areas(mask, labels, count).tolist() == known[:, cv2.CC_STAT_AREA].tolist()


@pytest.mark.parametrize("hole", [0, 3, 20])
def test_small_holes_are_filled_and_large_ones_stay(hole: int) -> None:
    mask = np.zeros((60, 60), dtype=bool)
    mask[10:50, 10:50] = True
    mask[20 : 20 + hole, 20 : 20 + hole] = False
    found = clean_mask(mask, 100)
    assert found is not None
    assert found.sum() == (1600 if hole < 20 else 1200)

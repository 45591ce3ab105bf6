"""Views without narrow gaps: what they add, and where there is nothing to add."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from visup.percepts.shape.building.closed_views import CLOSING_RADIUS, MIN_GAIN, without_gaps
from visup.percepts.shape.matching.shape_similarity import compare_shapes, shape_of
from visup.percepts.shape.silhouette.silhouette import normalise


def panels_mask(gap: int) -> np.ndarray:
    """Two panels on either end of a mast."""
    mask = np.zeros((200, 120), bool)
    mask[:, 56:64] = True
    for top in (0, 160):
        mask[top : top + 18, 10:110] = mask[top + 18 + gap : top + 36 + gap, 10:110] = True
    return mask


@given(st.integers(0, 200))
def test_closing_removes_nothing_and_small_gains_are_dropped(seed: int) -> None:
    rng = np.random.default_rng(seed)
    noise = cv2.GaussianBlur(rng.normal(size=(60, 80)).astype(np.float32), (0, 0), 3)
    mask = noise > 0
    closed = without_gaps(mask)
    if closed is not None:
        assert (closed | ~mask).all()
        assert closed.sum() >= (1 + MIN_GAIN) * mask.sum()


@pytest.mark.parametrize("gap", [4, 8])
def test_a_narrow_gap_is_filled(gap: int) -> None:
    closed = without_gaps(panels_mask(gap))
    assert gap < 2 * CLOSING_RADIUS * panels_mask(gap).sum() ** 0.5
    assert closed is not None
    assert closed[18 : 18 + gap, 20:100].all()


def test_a_disc_has_no_gap() -> None:
    ys, xs = np.mgrid[:80, :80]
    assert without_gaps(np.hypot(ys - 40, xs - 40) < 35) is None


def test_a_filled_silhouette_matches_the_closed_view_better() -> None:
    seen = panels_mask(8)
    seen[18:26, 10:110] = seen[178:186, 10:110] = True
    shapes = [
        shape_of(s)
        for m in (seen, panels_mask(8), without_gaps(panels_mask(8)))
        if m is not None and (s := normalise(m)) is not None
    ]
    assert len(shapes) == 3
    segmented, plain, closed = shapes
    assert (
        compare_shapes(segmented, closed, rigid=True).similarity
        > compare_shapes(segmented, plain, rigid=True).similarity + 0.1
    )

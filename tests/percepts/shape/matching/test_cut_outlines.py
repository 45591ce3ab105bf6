"""Outlines of cut silhouettes against those of cut views, in a common frame."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.percepts.shape.shapes import ZOO, shape
from visup.percepts.shape.matching.cut_outlines import compare_cut_outlines, outline_in_common_frame
from visup.percepts.shape.matching.truncated_views import CutLine, cut_outline
from visup.percepts.shape.silhouette.silhouette import polygon_moments

NAMES = sorted(ZOO)
names = st.sampled_from(NAMES)
bearings = st.floats(-3.1, 3.1)
offsets = st.floats(0.1, 0.6)


@settings(max_examples=40, deadline=None)
@given(names, bearings, offsets, st.booleans())
def test_the_common_frame_is_that_of_the_line(
    name: str, bearing: float, offset: float, mirrored: bool
) -> None:
    left = outline_in_common_frame(shape(ZOO[name]).contour, bearing, offset, mirrored=mirrored)
    area, centroid = polygon_moments(left)
    # Even points cut corners: a little of the area is lost.
    assert area == pytest.approx(1.0, abs=0.08)
    assert np.abs(centroid).max() < 0.05
    right = left[:, 0].max()
    on_line = left[left[:, 0] > right - 0.03]
    assert left[0, 0] > right - 0.05
    assert left[0, 1] > on_line[:, 1].max() - 0.1


@settings(max_examples=40, deadline=None)
@given(names, bearings, offsets, st.floats(-3.1, 3.1), st.booleans())
def test_a_view_matches_itself_cut_and_rotated(
    name: str, bearing: float, offset: float, turn: float, mirrored: bool
) -> None:
    """What a line left of it, turned and mirrored, is held against the view cut by the same line."""
    view = shape(ZOO[name]).contour
    seen = cut_outline(view, CutLine(bearing, offset, 0.0, 1.0, mirrored))
    if mirrored:
        seen, border = (seen * (-1, 1))[::-1], np.pi - bearing
    else:
        border = bearing
    cos, sin = np.cos(turn), np.sin(turn)
    turned = seen @ np.array([[cos, sin], [-sin, cos]])
    line = np.array([[bearing, offset, float(mirrored)]])
    assert compare_cut_outlines(turned, border + turn, [view], line)[0] > 0.9


def test_another_view_is_less_similar() -> None:
    view, others = shape(ZOO["walker"]).contour, [shape(ZOO[n]).contour for n in NAMES]
    line = np.array([[0.7, 0.3, 0.0]])
    seen = cut_outline(view, CutLine(0.7, 0.3, 0.0, 1.0, False))
    alike = compare_cut_outlines(seen, 0.7, others, np.repeat(line, len(others), axis=0))
    assert NAMES[int(np.argmax(alike))] == "walker"
    assert np.sort(alike)[-2] < 0.8


def test_comparing_with_no_views_gives_no_similarities() -> None:
    assert compare_cut_outlines(shape(ZOO["pear"]).contour, 0.0, [], np.empty((0, 3))).size == 0

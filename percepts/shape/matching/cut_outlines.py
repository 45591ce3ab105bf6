"""Outlines of cut silhouettes compared with those of cut views, in a common frame.

The position of the border is known in either: both are rotated so that it is on the right, and start where
the outline leaves it. Without a rotation search this is quicker than for whole shapes, and more
discriminative.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from visup.percepts.shape.matching._cut_outlines_jit import compare_cut, to_common_frame
from visup.percepts.shape.matching.shape_similarity import OUTLINE_SCALE
from visup.percepts.shape.silhouette._height_functions_jit import complexity, heights_along
from visup.percepts.shape.silhouette.height_functions import (
    BAND,
    COMPLEXITY_OFFSET,
    HEIGHTS,
    POINTS,
    SKIP_COST,
    stretches,
)


def compare_cut_outlines(
    contour: NDArray[np.floating],
    border: float,
    views: Sequence[NDArray[np.floating]],
    lines: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Compare the outline of a cut silhouette with those of views, each cut by a line.

    Args:
        contour: (N, 2) outline of the silhouette in normal form, the border's stretch included.
        border: Bearing of the border, radians; see `silhouette.Silhouette`.
        views: K outlines in normal form.
        lines: (K, 3) bearing of each line's outward normal in the view's frame (radians from x towards
            y), its offset along it, and 1 where the remainder is mirrored, else 0.

    Returns:
        (K,) similarities, 0 to 1.
    """
    if not len(views):
        return np.empty(0)
    outline = outline_in_common_frame(contour, border)
    heights = np.empty((POINTS, HEIGHTS), np.float32)
    heights_along(outline, stretches(), heights)
    bearings, offsets, mirrored = lines.T
    rows = np.stack([np.cos(bearings), np.sin(bearings), offsets, mirrored], axis=1)
    points = np.concatenate([np.asarray(v, dtype=np.float64) for v in views])
    starts = np.concatenate([[0], np.cumsum([len(v) for v in views])]).astype(np.intp)
    out = np.empty((len(views), 2))
    compare_cut(heights, (points, starts), rows, (stretches(), BAND, SKIP_COST), out)
    distance = out[:, 0] / (COMPLEXITY_OFFSET + complexity(heights) + out[:, 1])
    return np.asarray(np.exp(-((distance / OUTLINE_SCALE) ** 2)))


def outline_in_common_frame(
    contour: NDArray[np.floating],
    bearing: float,
    offset: float = np.inf,
    *,
    mirrored: bool = False,
) -> NDArray[np.float64]:
    """An outline clipped by a line, in the common frame of cut outlines.

    Args:
        contour: (N, 2) closed outline.
        bearing: Direction of the line's outward normal, radians from x towards y.
        offset: Of the line along it; infinite where the outline is already cut.
        mirrored: Whether the outline is mirrored along the line.

    Returns:
        (POINTS, 2) evenly spaced from the lower end of the line, of unit area about the centroid,
        the line on the right.
    """
    points = np.array(contour, dtype=np.float64)
    line, out = np.array([np.cos(bearing), np.sin(bearing), offset]), np.empty((POINTS, 2))
    to_common_frame(points, line, mirrored, np.empty((2 * len(points) + 2, 2)), out)
    return out

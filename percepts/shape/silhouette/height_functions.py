"""Comparison of outlines point by point, by height functions.

Every point of an outline is described by the heights of the rest of the outline over the tangent there, in
order along the outline (height functions; Wang, Bai, You, Liu and Latecki, Shape Matching and Classification
Using Height Functions, 2012). Two outlines are aligned by dynamic programming in a band around the best few
rotations, mirrored ones too. Different here: squared distances, and a band of slopes.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from visup.percepts.shape.silhouette._height_functions_jit import alignments, heights_along
from visup.percepts.shape.silhouette.silhouette import resample_closed

POINTS = 96
"""Points along an outline."""

HEIGHTS = 24
"""Heights describing a point."""

SKIP_COST = 0.2
"""Cost of each sideways step."""

BAND = 12
"""Points by which an alignment may lead or lag a rotation."""

COMPLEXITY_OFFSET = 0.2
"""Constant added to the outlines' complexity, the divisor of distances: plain outlines differ little."""

_ROTATIONS = 3


def outline_heights(contour: NDArray[np.floating]) -> NDArray[np.float32]:
    """Height functions of an outline.

    Args:
        contour: (N, 2) closed outline of unit area.

    Returns:
        (POINTS, HEIGHTS) float32: for evenly spaced points, the heights of the following stretches of
        outline over the tangent, each divided by its greatest on this outline. The mirror image of
        the outline has the same array with both axes reversed.
    """
    points = resample_closed(np.asarray(contour, dtype=np.float64), count=POINTS)
    heights = np.empty((POINTS, HEIGHTS), dtype=np.float32)
    heights_along(np.ascontiguousarray(points), stretches(), heights)
    return heights


@lru_cache(maxsize=1)
def stretches() -> NDArray[np.intp]:
    """Starts of the stretches of points after a point, and the end of the last, (HEIGHTS + 1,)."""
    return np.linspace(0, POINTS - 1, HEIGHTS + 1).round().astype(np.intp)


def outline_distances(
    first: NDArray[np.float32], second: NDArray[np.float32]
) -> NDArray[np.float64]:
    """Distances of pairs of outlines, each at its best rotation, as they are and mirrored.

    Args:
        first: (B, POINTS, HEIGHTS), or (1, POINTS, HEIGHTS) to compare one with all.
        second: (B, POINTS, HEIGHTS), the other outlines.

    Returns:
        (B, 2) float64, 0 for equal outlines; about 0.2 within a class and 0.45 between. The second
        column is for the mirror image.
    """
    least = np.empty((len(second), 2))
    one, other = np.ascontiguousarray(first), np.ascontiguousarray(second)
    alignments(one, other, _ROTATIONS, BAND, SKIP_COST, least)
    varied = _complexities(first) + _complexities(second)
    return least / (COMPLEXITY_OFFSET + varied)[:, None]


def _complexities(heights: NDArray[np.float32]) -> NDArray[np.float64]:
    return np.asarray(heights.std(axis=1).mean(axis=1), dtype=np.float64)

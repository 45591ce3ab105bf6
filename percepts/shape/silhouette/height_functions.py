"""Outlines compared point by point: the second look at views that the shock graph thinks likely.

Every point of an outline is described by how high the rest of the outline stands over the tangent
there, in order along the outline (height functions; Wang, Bai, You, Liu and Latecki, Shape Matching
and Classification Using Height Functions, 2012). Two outlines are aligned by dynamic programming in a
band around the best few rotations, mirrored ones too. Where ours differs: squared distances, so that
one matrix product compares all points; a band of slopes; and all candidates are aligned at once.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from visup.percepts.shape.silhouette.silhouette import resample_closed

POINTS = 96
"""Points along an outline."""

HEIGHTS = 24
"""Heights that describe a point."""

SKIP = 0.2
"""Cost of a step that is not straight on, per step."""

_ROTATIONS = 3
_BAND = 12
_BETA = 0.2
# Outlines compared at once: more do not fit the processor's cache.
_BLOCK = 16


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
    tangent = np.roll(points, -1, axis=0) - np.roll(points, 1, axis=0)
    tangent /= np.hypot(*tangent.T)[:, None] + 1e-12
    normal = np.stack([-tangent[:, 1], tangent[:, 0]], axis=1)
    following, stops = _following()
    # Height over the tangent: along the normal, from the point itself.
    along = normal @ points.T
    heights = np.take_along_axis(along, following, axis=1) - np.diagonal(along)[:, None]
    means = np.add.reduceat(heights, stops[:-1], axis=1) / np.diff(stops)
    return np.asarray(means / (np.abs(means).max(axis=0) + 0.05), dtype=np.float32)


@lru_cache(maxsize=1)
def _following() -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Numbers of the points that follow each, in order, and where each stretch of them begins."""
    following = (np.arange(POINTS)[:, None] + np.arange(1, POINTS)) % POINTS
    stops = np.linspace(0, POINTS - 1, HEIGHTS + 1).round().astype(np.intp)
    return following.astype(np.intp), stops


def outline_distances(
    first: NDArray[np.float32], second: NDArray[np.float32]
) -> NDArray[np.float64]:
    """Distances of pairs of outlines, each at its best rotation, as they are and mirrored.

    Args:
        first: (B, POINTS, HEIGHTS) or, for one that is compared with all, (1, POINTS, HEIGHTS).
        second: (B, POINTS, HEIGHTS), the other outlines.

    Returns:
        (B, 2) float64, 0 for equal outlines; about 0.2 within a class and 0.45 between. The second
        column is that of the mirror image.
    """
    count = len(second)
    least = np.empty((count, 2))
    for begin in range(0, count, _BLOCK):
        part = slice(begin, begin + _BLOCK)
        least[part] = _least(first if len(first) == 1 else first[part], second[part])
    varied = _complexities(first) + _complexities(second)
    return least / (_BETA + varied)[:, None]


def _least(first: NDArray[np.float32], second: NDArray[np.float32]) -> NDArray[np.float64]:
    """Least mean costs (B, 2) of alignments with the second outlines and with their mirror images."""
    both = np.stack([second, second[:, ::-1, ::-1]], axis=1)
    costs = _point_costs(first[:, None], both).reshape(2 * len(second), -1)
    shifted = costs.take(_shifts(), axis=1).reshape(-1, POINTS, POINTS)
    return _align(shifted).reshape(-1, 2)


def _complexities(heights: NDArray[np.float32]) -> NDArray[np.float64]:
    return np.asarray(heights.std(axis=1).mean(axis=1), dtype=np.float64)


def _point_costs(a: NDArray[np.float32], b: NDArray[np.float32]) -> NDArray[np.float32]:
    """Root mean squared difference of heights between all points of both."""
    scale = np.float32(HEIGHTS**-0.5)
    one, other = a * scale, b * scale
    # One product gives a squared difference whole: |a|^2 and |b|^2 are two more columns of it.
    ones = np.ones((), dtype=np.float32)
    left = _with_columns(-2 * one, (one**2).sum(axis=-1), ones)
    right = _with_columns(other, ones, (other**2).sum(axis=-1))
    costs: NDArray[np.float32] = np.matmul(left, right.swapaxes(-1, -2))
    # Below this, single precision cannot tell a difference from none.
    costs -= np.float32(1e-6)
    np.maximum(costs, 0.0, out=costs)
    return np.sqrt(costs, out=costs)


def _with_columns(
    heights: NDArray[np.float32], *columns: NDArray[np.float32]
) -> NDArray[np.float32]:
    shape = heights.shape[:-1]
    more = [np.broadcast_to(c, shape)[..., None] for c in columns]
    return np.concatenate([heights, *more], axis=-1)


@lru_cache(maxsize=1)
def _shifts() -> NDArray[np.intp]:
    """Where the diagonals lie in a flat cost matrix: row d holds (i, i + d) for all i."""
    i, d = np.arange(POINTS), np.arange(POINTS)
    return np.asarray(i[None] * POINTS + (i[None] + d[:, None]) % POINTS, dtype=np.intp).ravel()


def _align(shifted: NDArray[np.float32]) -> NDArray[np.float64]:
    """Least mean cost of an alignment, (B,), from costs by diagonal, (B, POINTS, POINTS)."""
    diagonal = _best_diagonals(shifted.sum(axis=-1))
    band = (diagonal[..., None] + np.arange(-_BAND, _BAND + 1)) % POINTS
    rows = np.arange(len(shifted))[:, None, None]
    lanes = np.ascontiguousarray(np.moveaxis(shifted[rows, band], -1, 0))
    return np.asarray(_descend(lanes).min(axis=(1, 2)).astype(np.float64) / POINTS)


def _best_diagonals(sums: NDArray[np.float32]) -> NDArray[np.intp]:
    """The best few local minima (B, R) among the sums along diagonals, (B, POINTS)."""
    lower = (sums <= np.roll(sums, 1, axis=1)) & (sums <= np.roll(sums, -1, axis=1))
    candidates = np.where(lower, sums, np.inf)
    return np.argsort(candidates, axis=1, kind="stable")[:, :_ROTATIONS]


def _descend(lanes: NDArray[np.float32]) -> NDArray[np.float32]:
    """Dynamic programming along (POINTS, B, R, lanes): straight on, or one lane aside for a price."""
    total: NDArray[np.float32] = lanes[0].copy()
    best, aside = np.empty_like(total), np.empty_like(total)
    for costs in lanes[1:]:
        np.add(total, SKIP, out=aside)
        np.minimum(total[..., 1:], aside[..., :-1], out=best[..., 1:])
        best[..., 0] = total[..., 0]
        np.minimum(best[..., :-1], aside[..., 1:], out=best[..., :-1])
        np.add(best, costs, out=total)
    return total

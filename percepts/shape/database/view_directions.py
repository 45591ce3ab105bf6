"""Directions of views: merging of symmetric views, and neighbourhood.

Two views are merged when their outlines, rotated in the plane or mirrored, coincide. In parallel projection
the silhouette from behind is the mirror image of the one from the front: a view that matches the mirror image
of another shows it, unmirrored, from the opposite direction.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from visup.percepts.shape.index.view_records import Direction, NewView
from visup.percepts.shape.silhouette.silhouette import resample_closed

SAME_OUTLINE_DISTANCE = 0.005
"""Distance of outlines below which two views are merged, in square roots of their area."""

SAME_AREA_DIFFERENCE = 0.01
"""Largest relative difference of their areas: a model's size is the same from all sides."""

_POINTS = 384


def merge_symmetric(views: Sequence[NewView]) -> list[NewView]:
    """Merge views of one model that look the same from several directions.

    Args:
        views: In order; a view joins the first one that it matches. Views of unknown direction or size
            stay as they are.

    Returns:
        The remaining views, in order; `further_directions` holds the directions of those merged into them.
    """
    waves = [frequencies(v.shape.contour) for v in views]
    areas = np.array([v.area or np.nan for v in views])
    retained: list[int] = []
    further_directions: dict[int, tuple[Direction, ...]] = {}
    for k, view in enumerate(views):
        match = None if view.direction is None else _first_match(k, retained, waves, areas)
        if match is None or view.direction is None:
            retained.append(k)
            continue
        number, mirrored = match
        x, y, z = view.direction
        direction = (-x, -y, -z) if mirrored else view.direction
        further_directions[number] = (*further_directions.get(number, ()), direction)
    return [
        replace(views[k], also=(*views[k].also, *further_directions.get(k, ()))) for k in retained
    ]


def frequencies(contour: NDArray[np.floating]) -> NDArray[np.complex128]:
    """Fourier coefficients (P,) of an outline (N, 2), resampled evenly as complex numbers."""
    points = resample_closed(np.asarray(contour, dtype=np.float64), count=_POINTS)
    return np.asarray(np.fft.fft(points[:, 0] + 1j * points[:, 1]))


def _first_match(
    number: int,
    retained: Sequence[int],
    waves: Sequence[NDArray[np.complex128]],
    areas: NDArray[np.float64],
) -> tuple[int, bool] | None:
    """The first retained view that this one matches, and whether mirrored."""
    near = np.abs(areas[list(retained)] / areas[number] - 1) < SAME_AREA_DIFFERENCE
    for k in np.flatnonzero(near):
        other = retained[int(k)]
        straight, mirror = outline_gap(waves[number], waves[other])
        if min(straight, mirror) < SAME_OUTLINE_DISTANCE:
            return other, mirror < straight
    return None


def outline_gap(one: NDArray[np.complex128], other: NDArray[np.complex128]) -> tuple[float, float]:
    """Distance between two outlines at their best rotation.

    Args:
        one: `frequencies` of an outline about its centroid.
        other: The same of the other.

    Returns:
        Root mean squared distance of corresponding points at the best rotation and starting point;
        and the same for the mirror image of the other.
    """
    size = len(one)
    energy = float((np.abs(one) ** 2).sum() + (np.abs(other) ** 2).sum()) / size
    # A mirrored outline runs backwards: conjugate points in opposite order.
    gaps = []
    for candidate in (other, np.conj(other)):
        correlation = np.abs(np.fft.ifft(np.conj(one) * candidate)).max()
        gaps.append(float(np.sqrt(max(0.0, energy - 2 * correlation) / size)))
    return gaps[0], gaps[1]


def neighbours(seen_from: Sequence[Sequence[Direction]]) -> list[tuple[int, ...]]:
    """Which views of a model are neighbours on the sphere of directions.

    A view covers its directions and, mirrored, the opposite ones. Two views are neighbours when an edge
    of the convex hull of all these joins them (the Delaunay triangulation of the sphere).

    Args:
        seen_from: For each view the directions that show it; none when unknown.

    Returns:
        For each view the numbers of its neighbours, ascending.

    Example:
        Three views along the axes cover the six corners of an octahedron.

        >>> neighbours([[(1, 0, 0)], [(0, 1, 0)], [(0, 0, 1)], []])
        [(1, 2), (0, 2), (0, 1), ()]
    """
    owners = [k for k, directions in enumerate(seen_from) for _ in directions]
    vectors = np.array([d for directions in seen_from for d in directions]).reshape(-1, 3)
    points = np.concatenate([vectors, -vectors])
    found: list[set[int]] = [set() for _ in seen_from]
    for a, b in _hull_edges(points):
        one, other = owners[a % len(owners)], owners[b % len(owners)]
        if one != other:
            found[one].add(other)
            found[other].add(one)
    return [tuple(sorted(f)) for f in found]


def _hull_edges(points: NDArray[np.float64]) -> list[tuple[int, int]]:
    """Edges of the convex hull; all pairs when the points span no solid."""
    from scipy.spatial import ConvexHull, QhullError

    all_pairs = [(a, b) for a in range(len(points)) for b in range(a)]
    if len(points) < 5 or np.linalg.matrix_rank(points, tol=1e-6) < 3:
        return all_pairs
    try:
        corners = np.asarray(ConvexHull(points).simplices)
    except QhullError:
        return all_pairs
    sides = np.sort(np.concatenate([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [0, 2]]]))
    return [(int(a), int(b)) for a, b in np.unique(sides, axis=0)]

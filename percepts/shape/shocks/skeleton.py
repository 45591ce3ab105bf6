"""Skeletons: the medial axis of an outline, pruned to its significant branches.

The skeleton is computed from the Delaunay triangles of the outline's points, whose circumcentres lie on it:
positions and radii are sub-pixel and independent of the pixel grid. A piece of it is significant by how much
longer the outline is between the two touching points than the arc of the inscribed circle (the circularity
residual of Ogniewicz and Kubler, Hierarchic Voronoi Skeletons, 1995). The residual grows monotonically
towards the middle of a shape, so that pruning by it leaves a connected tree; on a disc it is zero everywhere
and only the centre remains.
Read next: `shock_labels.py`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import Delaunay, QhullError

SIGNIFICANCE = 0.08
"""Least residual of a piece of skeleton, in units of the square root of the area."""

JOIN = 0.3
"""Branching points closer than this share of their radius are merged."""


LONGEST_EDGE = 0.05
"""Most distance between neighbouring points of a skeleton, units."""


@dataclass(frozen=True, slots=True, eq=False)
class Skeleton:
    """A tree of points with radii.

    Attributes:
        points: (V, 2) float64, (x, y) in the silhouette's units.
        radii: (V,) float64, radius of the largest disc inside the outline at each point.
        branches: Runs of point numbers, each from one branching or end point to the next; together they
            form a tree. Empty when the skeleton is a single point (a disc).
    """

    points: NDArray[np.float64]
    radii: NDArray[np.float64]
    branches: tuple[NDArray[np.intp], ...]


def skeletonise(contour: NDArray[np.float64], significance: float = SIGNIFICANCE) -> Skeleton:
    """The significant skeleton of an outline.

    Args:
        contour: (N, 2) evenly spaced outline of unit area, clockwise with y down.
        significance: Least residual, in units of the square root of the area.

    Returns:
        A connected skeleton; of a disc or of an outline too small to triangulate, one point.

    Example:
        >>> strip = np.array([[x / 10, -0.25] for x in range(-10, 10)]
        ...     + [[1.0, y / 40] for y in range(-10, 10)]
        ...     + [[-x / 10, 0.25] for x in range(-10, 10)]
        ...     + [[-1.0, -y / 40] for y in range(-10, 10)])
        >>> s = skeletonise(strip)
        >>> len(s.branches), float(s.radii.max().round(2))
        (5, 0.25)
    """
    found = _voronoi_tree(contour, significance)
    if found is None:
        return _single_point(contour)
    points, radii, edges = found
    return _join_near(points, radii, _trace(edges, len(points)))


def _single_point(contour: NDArray[np.float64]) -> Skeleton:
    centre = contour.mean(axis=0)
    radius = float(np.hypot(*(contour - centre).T).min())
    return Skeleton(centre[None], np.array([radius]), ())


def _voronoi_tree(
    contour: NDArray[np.float64], significance: float
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.intp]] | None:
    """Centres, radii and edges of the significant part; or its single best centre without edges."""
    try:
        mesh = Delaunay(contour)
    except QhullError:
        return None
    triangles = mesh.simplices
    centres, radii = _circumcircles(contour[triangles])
    inside = _inside(contour, triangles) & np.isfinite(radii)
    if not inside.any():
        return None
    faces = np.repeat(np.arange(len(triangles)), 3)
    other = mesh.neighbors.ravel()
    once = (other > faces) & inside[faces] & (other >= 0)
    once &= inside[np.where(other >= 0, other, 0)]
    a, b = faces[once], other[once]
    side = np.tile(np.arange(3), len(triangles))[once]
    i = triangles[a, (side + 1) % 3]
    j = triangles[a, (side + 2) % 3]
    keep = _residual(contour, i, j, 0.5 * (centres[a] + centres[b])) > significance
    if not keep.any():
        best = int(np.argmax(np.where(inside, radii, -1.0)))
        return centres[best][None], radii[best][None], np.empty((0, 2), dtype=np.intp)
    edges, touched = _largest_tree(centres, np.stack([a[keep], b[keep]], axis=1), i[keep])
    return _subdivide(centres, radii, edges, contour[touched])


def _circumcircles(
    corners: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Centres (T, 2) and radii (T,) of the circles through three corners each, (T, 3, 2)."""
    a = corners[:, 0]
    b, c = corners[:, 1] - a, corners[:, 2] - a
    twice = 2 * (b[:, 0] * c[:, 1] - b[:, 1] * c[:, 0])
    with np.errstate(divide="ignore", invalid="ignore"):
        bb, cc = (b**2).sum(axis=1), (c**2).sum(axis=1)
        ux = (c[:, 1] * bb - b[:, 1] * cc) / twice
        uy = (b[:, 0] * cc - c[:, 0] * bb) / twice
    centre = np.stack([ux, uy], axis=1)
    return a + centre, np.hypot(ux, uy)


def _inside(contour: NDArray[np.float64], triangles: NDArray[np.int32]) -> NDArray[np.bool_]:
    """Which triangles between points of an outline lie inside it, (T,) bool.

    Neighbours on the outline share a side of some triangle, so that no triangle crosses the outline; one
    inside has its corner numbers in the same sense as the outline runs.
    """
    a, b, c = (contour[corner] for corner in np.sort(triangles, axis=1).T)
    u, v = b - a, c - a
    return np.asarray(u[:, 0] * v[:, 1] > u[:, 1] * v[:, 0])


def _residual(
    contour: NDArray[np.float64],
    i: NDArray[np.intp],
    j: NDArray[np.intp],
    centre: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Outline length between two touching points minus the circle's arc, the smaller of both sides."""
    steps = np.hypot(*(np.roll(contour, -1, axis=0) - contour).T)
    along = np.concatenate([[0.0], np.cumsum(steps)])
    total = along[-1]
    arc = np.mod(along[j] - along[i], total)
    u, v = contour[i] - centre, contour[j] - centre
    radius = 0.5 * (np.hypot(*u.T) + np.hypot(*v.T))
    turn = np.mod(np.arctan2(v[:, 1], v[:, 0]) - np.arctan2(u[:, 1], u[:, 0]), 2 * np.pi)
    return np.asarray(np.minimum(arc - radius * turn, (total - arc) - radius * (2 * np.pi - turn)))


def _largest_tree(
    points: NDArray[np.float64], edges: NDArray[np.intp], touched: NDArray[np.intp]
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """The edges of the largest connected part, with the outline point that each edge touches."""
    size = len(points)
    if len(np.unique(edges)) == len(edges) + 1:
        # Without cycles, one edge less than points means that all is connected.
        return edges, touched
    ones = np.ones(len(edges))
    _, part = connected_components(coo_matrix((ones, edges.T), shape=(size, size)), directed=False)
    lengths = np.hypot(*(points[edges[:, 0]] - points[edges[:, 1]]).T)
    biggest = np.argmax(np.bincount(part[edges[:, 0]], weights=lengths + 1e-9))
    kept = part[edges[:, 0]] == biggest
    return edges[kept], touched[kept]


def _subdivide(
    points: NDArray[np.float64],
    radii: NDArray[np.float64],
    edges: NDArray[np.intp],
    touching: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.intp]]:
    """The tree with points along its long edges, renumbered from 0.

    Between two dents of the outline an edge may be long with the least radius in its middle: a neck that
    its ends alone would miss.
    """
    used, numbers = np.unique(edges, return_inverse=True)
    edges = numbers.reshape(-1, 2).astype(np.intp)
    points, radii = points[used], radii[used]
    a, b = points[edges[:, 0]], points[edges[:, 1]]
    inner = np.ceil(np.hypot(*(b - a).T) / LONGEST_EDGE).astype(np.intp) - 1
    inner = np.clip(inner, 0, 400)
    owner = np.repeat(np.arange(len(edges)), inner)
    first = np.cumsum(inner) - inner
    step = (np.arange(len(owner)) - first[owner] + 1) / (inner[owner] + 1)
    added = a[owner] + (b - a)[owner] * step[:, None]
    reach = np.hypot(*(added - touching[owner]).T)
    return (
        np.vstack([points, added]),
        np.concatenate([radii, reach]),
        _chains(edges, inner, first + len(points)),
    )


def _chains(
    edges: NDArray[np.intp], inner: NDArray[np.intp], first: NDArray[np.intp]
) -> NDArray[np.intp]:
    """Edges replaced by chains through their inner points, numbered from `first`."""
    piece_of = np.repeat(np.arange(len(edges)), inner + 1)
    piece = np.arange(len(piece_of)) - (np.cumsum(inner + 1) - inner - 1)[piece_of]
    start = np.where(piece == 0, edges[piece_of, 0], first[piece_of] + piece - 1)
    stop = np.where(piece == inner[piece_of], edges[piece_of, 1], first[piece_of] + piece)
    return np.stack([start, stop], axis=1).astype(np.intp)


def _trace(edges: NDArray[np.intp], size: int) -> list[list[int]]:
    """Runs of points between branching and end points of a tree."""
    near: list[list[int]] = [[] for _ in range(size)]
    for a, b in edges.tolist():
        near[a].append(b)
        near[b].append(a)
    runs = []
    for start in range(size):
        if len(near[start]) == 2:
            continue
        for step in near[start]:
            run = [start, step]
            while len(near[run[-1]]) == 2:
                ahead, back = near[run[-1]]
                run.append(back if ahead == run[-2] else ahead)
            if run[0] < run[-1]:
                runs.append(run)
    return runs


def _join_near(
    points: NDArray[np.float64], radii: NDArray[np.float64], runs: list[list[int]]
) -> Skeleton:
    """Merge branching points that are close together, and drop unused points."""
    moved = np.arange(len(points))
    ends = [r[0] for r in runs] + [r[-1] for r in runs]
    degree = np.bincount(ends, minlength=len(points)) if ends else np.zeros(len(points), int)
    kept = []
    for run in sorted(runs, key=len):
        a, b = run[0], run[-1]
        length = float(np.hypot(*np.diff(points[run], axis=0).T).sum())
        inner = degree[a] > 1 and degree[b] > 1
        if inner and length < JOIN * min(radii[a], radii[b]):
            a, b = int(moved[a]), int(moved[b])
            winner, loser = (a, b) if (radii[a], -a) >= (radii[b], -b) else (b, a)
            moved[moved == loser] = winner
        else:
            kept.append(run)
    for run in kept:
        run[0], run[-1] = int(moved[run[0]]), int(moved[run[-1]])
    return _compact(points, radii, kept)


def _compact(
    points: NDArray[np.float64], radii: NDArray[np.float64], runs: list[list[int]]
) -> Skeleton:
    if not runs:
        best = int(np.argmax(radii))
        return Skeleton(points[best][None], radii[best][None], ())
    used, numbers = np.unique(np.concatenate([np.asarray(r) for r in runs]), return_inverse=True)
    splits = np.cumsum([len(r) for r in runs])[:-1]
    branches = tuple(np.asarray(b, dtype=np.intp) for b in np.split(numbers, splits))
    return Skeleton(points[used], radii[used], branches)

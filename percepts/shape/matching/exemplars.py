"""Exemplars: a few silhouettes that represent many.

The paper clusters the arm's silhouettes, one per frame, into 4 by K-means (section 7.2). Here the clusters
are around medoids, since shock graphs have distances but no means.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from visup.percepts.shape.matching.graph_matching import match_graphs
from visup.percepts.shape.matching.shape_similarity import (
    GRAPH_SHARE,
    Shape,
    compare_outlines_and_areas,
)
from visup.percepts.shape.silhouette.area_overlap import AreaIndex


def similarity_matrix(shapes: Sequence[Shape]) -> NDArray[np.float64]:
    """Similarities of all pairs, (N, N) float64 with ones on the diagonal."""
    out = np.eye(len(shapes))
    index = AreaIndex(np.stack([s.areas for s in shapes]))
    for i, shape in enumerate(shapes):
        comparison = compare_outlines_and_areas(
            shape, shapes[:i], index.overlaps(shape.areas, np.arange(i))
        )
        graphs = np.array([match_graphs(shape.graph, o.graph).similarity for o in shapes[:i]])
        out[i, :i] = out[:i, i] = GRAPH_SHARE * graphs + comparison.partial_similarity
    return out


def medoids(similarity: NDArray[np.float64], count: int) -> list[int]:
    """The most representative members: K-medoids, built greedily and then improved by swaps.

    Args:
        similarity: (N, N), symmetric.
        count: How many exemplars; all members when there are fewer.

    Returns:
        Numbers of the exemplars, ascending; deterministic.

    Example:
        >>> near = np.array([[1, .9, .1], [.9, 1, .1], [.1, .1, 1]])
        >>> medoids(near, 2)
        [0, 2]
    """
    size = len(similarity)
    if count >= size:
        return list(range(size))
    chosen: list[int] = []
    while len(chosen) < count:
        rest = [k for k in range(size) if k not in chosen]
        chosen.append(max(rest, key=lambda k: (_coverage(similarity, [*chosen, k]), -k)))
    return sorted(_improved_by_swaps(similarity, chosen))


def _coverage(similarity: NDArray[np.float64], chosen: list[int]) -> float:
    """Quality of the representation of all members: the sum of similarities to the nearest exemplar."""
    return float(similarity[:, chosen].max(axis=1).sum())


def _improved_by_swaps(similarity: NDArray[np.float64], chosen: list[int]) -> list[int]:
    """Swap an exemplar for a better one until no swap helps; at most 20 rounds."""
    best = _coverage(similarity, chosen)
    for _ in range(20):
        swaps = [
            [*chosen[:i], k, *chosen[i + 1 :]]
            for i in range(len(chosen))
            for k in range(len(similarity))
            if k not in chosen
        ]
        trial = max(swaps, key=lambda s: _coverage(similarity, s), default=chosen)
        value = _coverage(similarity, trial)
        if value <= best + 1e-9:
            return chosen
        chosen, best = trial, value
    return chosen

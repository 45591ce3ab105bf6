"""Two shapes compared: the shock graphs first, their outlines for a second look.

The shock graph chooses candidates, gives the correspondences and a share of the similarity; the outline
gives the rest. Both terms are kept apart in the result, so that a similarity can be explained.

Read next: `database.py`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from visup.percepts.shape.match import Match, match
from visup.percepts.shape.outline import outline_distances, outline_heights
from visup.percepts.shape.shock_graph import ShockGraph, shock_graph
from visup.percepts.shape.silhouette import Silhouette

GRAPH_SHARE = 0.2
"""Share of the similarity that the shock graph gives; the outline gives the rest."""

OUTLINE_SCALE = 0.42
"""Distance of outlines at which their similarity has fallen to 1/e."""


@dataclass(frozen=True, eq=False)
class Shape:
    """A silhouette with what is compared of it.

    Attributes:
        contour: (N, 2) outline in normal form.
        graph: Its shock graph.
        cut: Whether the image border cuts it.
    """

    contour: NDArray[np.floating]
    graph: ShockGraph
    cut: bool = False

    @cached_property
    def heights(self) -> NDArray[np.float32]:
        """Height functions of the outline; computed when first asked for."""
        return outline_heights(self.contour)


@dataclass(frozen=True, slots=True)
class Likeness:
    """How alike two shapes are, and why.

    Attributes:
        similarity: 0 to 1; 1 for equal shapes.
        of_graphs: Similarity of the shock graphs alone.
        of_outlines: Similarity of the outlines alone.
        match: Corresponding nodes.
        mirrored: Whether it is the mirror image of the one that looks like the other.
    """

    similarity: float
    of_graphs: float
    of_outlines: float
    match: Match
    mirrored: bool = False


def shape_of(silhouette: Silhouette) -> Shape:
    """What is compared of a silhouette in normal form."""
    return Shape(silhouette.contour, shock_graph(silhouette), silhouette.cut)


def compare(a: Shape, b: Shape) -> Likeness:
    """Compare two shapes; the same whichever comes first.

    Example:
        >>> from visup.percepts.shape.silhouette import normalise
        >>> y, x = np.mgrid[-40:41, -60:61]
        >>> disc = shape_of(normalise(np.hypot(x, y) < 30))
        >>> strip = shape_of(normalise((abs(x) < 55) & (abs(y) < 8)))
        >>> compare(disc, disc).similarity, compare(disc, strip).similarity < 0.3
        (1.0, True)
    """
    graphs = match(a.graph, b.graph)
    similar, mirrored = outline_similarities(a, [b])
    return join(graphs, float(similar[0]), bool(mirrored[0]))


def join(graphs: Match, of_outlines: float, mirrored: bool) -> Likeness:
    """The likeness that follows from both terms."""
    similarity = GRAPH_SHARE * graphs.similarity + (1 - GRAPH_SHARE) * of_outlines
    # Features are of single precision: further digits mean nothing, and equal shapes give exactly 1.
    return Likeness(
        min(1.0, round(similarity, 5)), graphs.similarity, of_outlines, graphs, mirrored
    )


def outline_similarities(
    query: Shape, others: Sequence[Shape]
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Similarity of one outline with many, (B,) in [0, 1], and which are alike mirrored, (B,) bool.

    Alignment is not quite the same in both directions; the shapes' own order decides on one.
    """
    if not others:
        return np.empty(0), np.empty(0, dtype=bool)
    heights = np.stack([o.heights for o in others])
    distance, mirrored = np.empty(len(others)), np.zeros(len(others), dtype=bool)
    query_first = np.array([query.graph.key <= o.graph.key for o in others])
    own = query.heights[None]
    if query_first.any():
        distance[query_first], mirrored[query_first] = outline_distances(own, heights[query_first])
    if not query_first.all():
        turned = outline_distances(heights[~query_first], own)
        distance[~query_first], mirrored[~query_first] = turned
    return np.exp(-((distance / OUTLINE_SCALE) ** 2)), mirrored

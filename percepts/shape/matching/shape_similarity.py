"""Similarity of two shapes: shock graphs, outlines and areas combined.

The shock graph gives the correspondences and a share of the similarity; outline alignment and area overlap
give the rest. All terms are kept separate in the result, so that a similarity can be explained.

Read next: `model_database.py`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from visup.percepts.shape.matching.graph_matching import GraphMatch, match_graphs
from visup.percepts.shape.shocks.shock_graph import ShockGraph, shock_graph
from visup.percepts.shape.silhouette.area_overlap import AreaOverlaps, area_overlaps
from visup.percepts.shape.silhouette.height_functions import outline_distances, outline_heights
from visup.percepts.shape.silhouette.silhouette import Silhouette

GRAPH_SHARE = 0.25
"""Share of the shock graph in the similarity when kinds of objects are compared."""

AREA_SHARE = 0.2
"""Share of the areas."""

KIND_SHARES = (GRAPH_SHARE, 1.0 - GRAPH_SHARE - AREA_SHARE, AREA_SHARE)
"""Shares of graph, outline and area when kinds of objects are compared: their limbs bend and differ."""

RIGID_SHARES = (0.1, 0.4, 0.5)
"""The same for a rigid object seen from a known direction: its area stays in place and hardly suffers from a
rough outline; outlines and skeletons suffer more."""

AREA_POWER = 8
"""Overlaps of dissimilar shapes are still high; this power spreads them like the other terms."""

OUTLINE_SCALE = 0.36
"""Distance of outlines at which their similarity is 1/e."""


@dataclass(frozen=True, eq=False)
class Shape:
    """The comparable features of a silhouette.

    Attributes:
        contour: (N, 2) outline in normal form.
        graph: Its shock graph.
        areas: (RINGS, ANGLES) uint8, its area by ring and angle; see `area_overlap.area_map`.
        cut: Whether the image border cuts it.
        border: Bearing of that border, radians; see `silhouette.Silhouette`.
    """

    contour: NDArray[np.floating]
    graph: ShockGraph
    areas: NDArray[np.uint8]
    cut: bool = False
    border: float | None = None

    @cached_property
    def heights(self) -> NDArray[np.float32]:
        """Height functions of the outline; computed on first use."""
        return outline_heights(self.contour)


@dataclass(frozen=True, slots=True)
class ShapeSimilarity:
    """The similarity of two shapes and its terms.

    Attributes:
        similarity: 0 to 1; 1 for equal shapes.
        graph_similarity: Similarity of the shock graphs alone.
        outline_similarity: Similarity of the outlines alone.
        area_similarity: Similarity of the areas alone.
        match: Corresponding nodes.
        mirrored: Whether the mirror image of the second matches the first.
        rotation: Radians from x towards y (clockwise in the image) that take the second, first mirrored left
            to right if `mirrored`, onto the first, in (-pi, pi].
    """

    similarity: float
    graph_similarity: float
    outline_similarity: float
    area_similarity: float
    match: GraphMatch
    mirrored: bool = False
    rotation: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class OutlineAreaSimilarities:
    """Similarities of one shape with others without their graphs, each as it is or mirrored.

    Attributes:
        outline_similarity: (B,) in [0, 1].
        area_similarity: (B,) in [0, 1].
        mirrored: (B,) bool.
        rotation: (B,) radians, as in `ShapeSimilarity`.
        shares: (B, 3) shares of graph, outline and area in the similarity.
    """

    outline_similarity: NDArray[np.float64]
    area_similarity: NDArray[np.float64]
    mirrored: NDArray[np.bool_]
    rotation: NDArray[np.float64]
    shares: NDArray[np.float64]

    @property
    def partial_similarity(self) -> NDArray[np.float64]:
        """(B,) contribution of outlines and areas to the similarity; the graph gives the rest."""
        return (
            self.shares[:, 1] * self.outline_similarity + self.shares[:, 2] * self.area_similarity
        )

    def with_graph(self, number: int, graphs: GraphMatch) -> ShapeSimilarity:
        """The similarity with one of the others, given the match of its graph."""
        similarity = float(
            self.shares[number, 0] * graphs.similarity + self.partial_similarity[number]
        )
        # Features are in single precision: rounded, so that equal shapes give exactly 1.
        return ShapeSimilarity(
            min(1.0, round(similarity, 5)),
            graphs.similarity,
            float(self.outline_similarity[number]),
            float(self.area_similarity[number]),
            graphs,
            bool(self.mirrored[number]),
            float(self.rotation[number]),
        )


def shape_of(silhouette: Silhouette) -> Shape:
    """The comparable features of a silhouette in normal form."""
    graph = shock_graph(silhouette)
    return Shape(silhouette.contour, graph, silhouette.areas, silhouette.cut, silhouette.border)


def compare_shapes(
    a: Shape, b: Shape, *, mirror: bool = True, rigid: bool = False
) -> ShapeSimilarity:
    """Compare two shapes; the similarity is symmetric.

    Args:
        a: The first shape.
        b: The second shape.
        mirror: Whether a shape also matches its mirror image, which the shock graph alone cannot
            distinguish.
        rigid: Whether one is a view of a rigid object (`RIGID_SHARES`); else kinds are compared.

    Example:
        >>> from visup.percepts.shape.silhouette.silhouette import normalise
        >>> y, x = np.mgrid[-40:41, -60:61]
        >>> disc = shape_of(normalise(np.hypot(x, y) < 30))
        >>> strip = shape_of(normalise((abs(x) < 55) & (abs(y) < 8)))
        >>> compare_shapes(disc, disc).similarity, compare_shapes(disc, strip).similarity < 0.35
        (1.0, True)
    """
    overlaps = area_overlaps(a.areas, b.areas[None])
    comparison = compare_outlines_and_areas(
        a, [b], overlaps, mirror=mirror, rigid=np.array([rigid])
    )
    return comparison.with_graph(0, match_graphs(a.graph, b.graph))


def compare_outlines_and_areas(
    query: Shape,
    others: Sequence[Shape],
    overlaps: AreaOverlaps,
    *,
    mirror: bool = True,
    rigid: NDArray[np.bool_] | None = None,
) -> OutlineAreaSimilarities:
    """Compare one shape's outline and area with many.

    Args:
        query: The shape.
        others: B shapes.
        overlaps: Overlaps of its area with theirs.
        mirror: Whether mirror images count.
        rigid: (B,) which of the others are views of a rigid object (`RIGID_SHARES`); none when None.
    """
    outlines, areas = _outline_similarities(query, others), overlaps.similarity**AREA_POWER
    is_rigid = np.zeros(len(others), dtype=bool) if rigid is None else rigid
    shares = np.where(is_rigid[:, None], RIGID_SHARES, KIND_SHARES)
    partial_similarity = shares[:, 1:2] * outlines + shares[:, 2:] * areas
    mirrored = (partial_similarity[:, 1] > partial_similarity[:, 0]) & mirror
    numbers, side = np.arange(len(others)), mirrored.astype(np.intp)
    return OutlineAreaSimilarities(
        outlines[numbers, side],
        areas[numbers, side],
        mirrored,
        overlaps.rotation[numbers, side],
        shares,
    )


def _outline_similarities(query: Shape, others: Sequence[Shape]) -> NDArray[np.float64]:
    """Similarity of one outline with many, as they are and mirrored, (B, 2) in [0, 1].

    Alignment is slightly asymmetric; a canonical order of the shapes makes the result symmetric.
    """
    if not others:
        return np.empty((0, 2))
    heights = np.stack([o.heights for o in others])
    query_heights = np.broadcast_to(query.heights, heights.shape)
    in_order = np.array([query.graph.key <= o.graph.key for o in others])[:, None, None]
    distance = outline_distances(
        np.where(in_order, query_heights, heights), np.where(in_order, heights, query_heights)
    )
    return np.asarray(np.exp(-((distance / OUTLINE_SCALE) ** 2)))

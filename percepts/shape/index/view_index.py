"""The index: which views of the database are worth a full comparison.

Three stages, each finer and more expensive than the previous:

1. *Roots.* A view's root carries its topological signature vector (Shokoufandeh et al. 2005), the radial
   distribution of the shape's area, and its greatest radius; its outline's spectrum is appended. One product
   of the query's vector with those of all views selects the nearest `NEAREST`.
2. *Sketches.* Of these, outlines are compared at a few points at all rotations, areas are overlaid, and roots
   compared again; that selects as many as are to be compared in full. A quarter of the places goes to models
   that would have none otherwise, so that a ranking of models is complete.
3. *Bounds.* One product of all nodes of the query with all nodes of these bounds each similarity: every node
   takes its best partner, regardless of other claims and of hierarchy. The matching of `graph_matching.py`
   can only do worse, so views are matched in order of their bounds until no remaining bound can change the
   result.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from visup.percepts.shape.index.outline_sketch import SPECTRUM, sketch, sketch_distances, spectra
from visup.percepts.shape.index.view_records import Records, graph_arrays, node_records
from visup.percepts.shape.matching.graph_matching import (
    WEIGHTS,
    MatchWeights,
    embed,
    node_similarities,
)
from visup.percepts.shape.matching.shape_similarity import Shape
from visup.percepts.shape.shocks.shock_graph import ShockGraph
from visup.percepts.shape.silhouette.area_overlap import AreaIndex, AreaOverlaps, area_overlaps

NEAREST = 500
"""Views whose sketches are compared."""

CACHED = 4096
"""Most views whose node features are cached in memory."""

# Scales that make squared distances of roots, squared ones of spectra, and distances of sketches comparable:
# medians over pairs of 39 meshes' views.
_ROOT_SCALE = 1.35
_SPECTRUM_SCALE = 0.106
_SKETCH_SCALE = 0.467
_AREA_SCALE = 0.25
_ROOT_SHARE = 0.3
_AREA_SHARE = 1.0


@dataclass(frozen=True, slots=True, eq=False)
class Candidates:
    """Views worth a full comparison.

    Attributes:
        numbers: (C,) numbers of the views, ascending.
        bounds: (C,) upper bounds of the graphs' similarities.
        similarities: For each view the (N, M) similarities of the query's nodes with the view's.
        overlaps: Area overlaps of the query with them.
    """

    numbers: NDArray[np.intp]
    bounds: NDArray[np.float64]
    similarities: list[NDArray[np.float32]]
    overlaps: AreaOverlaps


@dataclass(frozen=True, slots=True, eq=False)
class ViewSummaries:
    """The data of views for the first two stages.

    Attributes:
        roots: (V,) records of `view_records.NODE`.
        sketches: (V, POINTS, HEIGHTS) int8.
        areas: (V, RINGS, ANGLES) uint8.
        models: (V,) integers, equal for views of one model.
    """

    roots: Records
    sketches: NDArray[np.int8]
    areas: NDArray[np.uint8]
    models: NDArray[np.integer[Any]]

    @classmethod
    def read(cls, views: Records) -> ViewSummaries:
        """The summaries of views in a file, (V,) records of `view_records.VIEW`."""
        return cls(views["root"], views["sketch"], views["areas"], views["model"])

    @classmethod
    def of(cls, shapes: Sequence[Shape]) -> ViewSummaries:
        """The summaries of shapes in memory, at least one; each counts as a model of its own."""
        roots = np.concatenate([node_records(s.graph)[:1] for s in shapes])
        sketches = np.stack([sketch(s.heights) for s in shapes])
        areas = np.stack([s.areas for s in shapes])
        return cls(roots, sketches, areas, np.arange(len(shapes)))


class ViewIndex:
    """Selects the views worth a full comparison.

    Args:
        shapes: The views' shapes; only those of candidates are read when `summaries` are given.
        weights: How much each node feature counts.
        summaries: Summaries of the same views; computed from the shapes when None.
    """

    def __init__(
        self,
        shapes: Sequence[Shape],
        weights: MatchWeights = WEIGHTS,
        summaries: ViewSummaries | None = None,
    ) -> None:
        self.weights = weights
        self._shapes = shapes
        self._given_summaries = summaries
        self._features: OrderedDict[int, NDArray[np.float32]] = OrderedDict()

    def __len__(self) -> int:
        return len(self._shapes)

    @cached_property
    def _summaries(self) -> ViewSummaries:
        return self._given_summaries or ViewSummaries.of(self._shapes)

    @cached_property
    def _roots(self) -> NDArray[np.float32]:
        """(V, D) vectors of the first stage: the roots' features, then the outlines' spectra."""
        parts = [
            _vectors(self._summaries, slice(k, k + 4096), self.weights)
            for k in range(0, len(self), 4096)
        ]
        return np.concatenate(parts)

    @cached_property
    def _squares(self) -> NDArray[np.float32]:
        return np.asarray(np.einsum("ij,ij->i", self._roots, self._roots))

    def likeliest(
        self, query: Shape, among: NDArray[np.intp] | None, most: int
    ) -> NDArray[np.intp]:
        """The views likeliest to match a shape, by roots and sketches.

        Args:
            query: A shape.
            among: Numbers of views, ascending; all views when None.
            most: How many to return.

        Returns:
            At most `most` of the numbers, ascending.
        """
        size = len(self) if among is None else len(among)
        if size <= most:
            return np.arange(size) if among is None else among
        query_vector = _vectors(ViewSummaries.of([query]), slice(None), self.weights)[0]
        distances = self._squared_distances(query_vector, among)
        if size > (nearest := max(NEAREST, most)):
            nearest_numbers = np.argpartition(distances, nearest - 1)[:nearest]
            nearest_numbers.sort()
            among, distances = (
                (nearest_numbers if among is None else among[nearest_numbers]),
                distances[nearest_numbers],
            )
        among = np.arange(size) if among is None else among
        # The spectrum is dropped: the sketches contain the same information in more detail.
        features = len(query_vector) - SPECTRUM
        squares = ((self._roots[among, :features] - query_vector[:features]) ** 2).sum(axis=1)
        outlines = sketch_distances(sketch(query.heights), self._summaries.sketches[among])
        uncovered_share = 1.0 - self._area_similarities(query, among)
        distances = (
            outlines / _SKETCH_SCALE
            + _ROOT_SHARE * np.sqrt(squares)
            + _AREA_SHARE * np.sqrt(uncovered_share / _AREA_SCALE)
        )
        order = among[np.argsort(distances, kind="stable")]
        return np.sort(_with_every_model(order, self._summaries.models[order], most))

    def _squared_distances(
        self, own: NDArray[np.float32], among: NDArray[np.intp] | None
    ) -> NDArray[np.float32]:
        """Squared distances from views' vectors, without the constant term of the query."""
        if among is None or len(among) == len(self):
            return self._squares - 2 * (self._roots @ own)
        return np.asarray(self._squares[among] - 2 * (self._roots[among] @ own))

    def candidates(
        self,
        query: Shape,
        among: NDArray[np.intp] | None,
        most: int,
        always_included: NDArray[np.intp] | None = None,
    ) -> Candidates:
        """The views that are worth a full comparison.

        Args:
            query: A shape.
            among: Numbers of views, ascending; all views when None.
            most: How many to return.
            always_included: Numbers of views; the likeliest of these are added, as many again.
        """
        numbers = self.likeliest(query, among, most)
        if always_included is not None and len(always_included):
            extra = self.likeliest(query, always_included, most)
            numbers = np.union1d(numbers, extra).astype(np.intp)
        bounds, similar = self.bounds(query.graph, numbers)
        return Candidates(numbers, bounds, similar, self.overlaps(query, numbers))

    def overlaps(self, query: Shape, among: NDArray[np.intp]) -> AreaOverlaps:
        """Area overlaps of a shape with some views."""
        if len(self) <= CACHED:
            return self._areas.overlaps(query.areas, among)
        return area_overlaps(query.areas, self._summaries.areas[among])

    def _area_similarities(self, query: Shape, among: NDArray[np.intp]) -> NDArray[np.float64]:
        """Best area similarity of a shape with each of some views, mirrored or not, (V,)."""
        if len(self) <= CACHED:
            similar = self._areas.similarities(query.areas, among)
        else:
            similar = AreaIndex(self._summaries.areas[among]).similarities(query.areas)
        return np.asarray(similar.max(axis=1))

    def best_overlapping(
        self, query: Shape, among: NDArray[np.intp], most: int
    ) -> NDArray[np.intp]:
        """The views of best area overlap with a shape: at most `most` of the numbers, ascending."""
        covered = [
            self._area_similarities(query, among[k : k + CACHED])
            for k in range(0, len(among), CACHED)
        ]
        return np.sort(among[np.argsort(-np.concatenate(covered), kind="stable")[:most]])

    @cached_property
    def _areas(self) -> AreaIndex:
        return AreaIndex(self._summaries.areas)

    def bounds(
        self, query: ShockGraph, among: NDArray[np.intp], *, part: bool = False
    ) -> tuple[NDArray[np.float64], list[NDArray[np.float32]]]:
        """Bound the similarity of a query with views.

        Args:
            query: A shock graph of N nodes.
            among: Numbers of the views, ascending.
            part: Whether the query is a part only, so that the views' other nodes do not count.

        Returns:
            (V,) float64, for each view an upper bound of `match_nodes`; and for each view the
            (N, M) similarities of the query's nodes with the view's.
        """
        if not len(among):
            return np.empty(0), []
        features = [self._nodes(int(k)) for k in among]
        sizes = np.array([len(f) for f in features])
        starts = np.concatenate([[0], np.cumsum(sizes)[:-1]]).astype(np.intp)
        shares = np.concatenate([self._shapes[int(k)].graph.weights for k in among])
        similarities = node_similarities(embed(query, self.weights), np.concatenate(features))
        roots = similarities[0, starts].astype(np.float64)
        inner = similarities[1:].copy()
        inner[:, starts] = 0.0
        forward = query.weights[1:] @ np.maximum.reduceat(inner, starts, axis=1)
        backward = np.add.reduceat(inner.max(axis=0) * shares, starts)
        nodes = forward if part else 0.5 * (forward + backward)
        bounds = self.weights.root * roots + (1 - self.weights.root) * nodes
        ends = np.append(starts[1:], len(shares)).tolist()
        return bounds, [similarities[:, a:b] for a, b in zip(starts.tolist(), ends, strict=True)]

    def _nodes(self, view: int) -> NDArray[np.float32]:
        """Features of a view's nodes, cached."""
        cached = self._features.get(view)
        if cached is None:
            cached = embed(self._shapes[view].graph, self.weights)
            self._features[view] = cached
            if len(self._features) > CACHED:
                self._features.popitem(last=False)
        return cached


def _with_every_model(
    order: NDArray[np.intp], models: NDArray[np.integer[Any]], most: int
) -> NDArray[np.intp]:
    """The first `most` of an order; a quarter of the places goes to models without one."""
    sure = most - most // 4
    later, first_of = order[sure:], np.unique(models[sure:], return_index=True)
    new = np.sort(first_of[1][~np.isin(first_of[0], models[:sure])])[: most // 4]
    others = np.delete(np.arange(len(later)), new)[: most - sure - len(new)]
    return np.concatenate([order[:sure], later[new], later[others]])


def _vectors(summaries: ViewSummaries, part: slice, weights: MatchWeights) -> NDArray[np.float32]:
    """Vectors of the first stage for some of the views: root features, then spectra, both scaled."""
    features = embed(_roots_as_nodes(summaries.roots[part]), weights)
    waves = spectra(summaries.sketches[part]) / np.float32(_SPECTRUM_SCALE**0.5)
    return np.hstack([features / np.float32(_ROOT_SCALE**0.5), waves])


def _roots_as_nodes(roots: Records) -> ShockGraph:
    """Roots of many views as the nodes of one graph: node features do not depend on edges."""
    return ShockGraph(
        edges=np.empty((0, 2), dtype=np.int16),
        below=np.empty((0, 0), dtype=bool),
        key=b"",
        **graph_arrays(roots),
    )

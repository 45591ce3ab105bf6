"""The search: from a shape to its most similar views, best first.

Whole shapes: the index selects the likeliest views; their areas and outlines are compared first, then their
shock graphs, until no other view can do better. Shapes cut by the image border: the views most similar to it
after the same cut (`truncated_views.py`) are compared in the same way, with the shape's graph as a part of
theirs.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from visup.percepts.shape.database.catalogue import Shapes, Views
from visup.percepts.shape.index.view_index import ViewIndex, ViewSummaries
from visup.percepts.shape.index.view_records import ModelView
from visup.percepts.shape.matching.cut_outlines import compare_cut_outlines
from visup.percepts.shape.matching.graph_matching import (
    GraphMatch,
    MatchWeights,
    match_nodes,
    match_upper_bound,
)
from visup.percepts.shape.matching.shape_similarity import (
    AREA_POWER,
    OutlineAreaSimilarities,
    Shape,
    ShapeSimilarity,
    compare_outlines_and_areas,
)
from visup.percepts.shape.matching.truncated_views import CutIndex, CutLine, query_map
from visup.percepts.shape.shocks.shock_graph import ShockGraph

CUT_SHARE = 0.95
"""Factor of a similarity for which a whole view had to be cut, since the cut is a free parameter."""

CUT_SHARES = (0.05, 0.8, 0.15)
"""Shares of graph, outline and area in that similarity: a cut changes a skeleton most, and the area already
decided where to cut."""

CUT_BREADTH = 6
"""Factor of outlines compared relative to whole silhouettes: starting at the border they are as quick to
compare, and a part resembles more objects than a whole."""

CUT_VIEWS = 1000
"""Most whole views cut for one silhouette; of more, those of best area overlap."""

_PART_WEIGHTS = MatchWeights(
    kind=0.3, length=0.8, profile=3.5, context=0.0, signature=0.0, root=0.0
)


@dataclass(frozen=True, slots=True)
class ViewMatch:
    """A view that matches a silhouette.

    Attributes:
        view: The view.
        terms: Their similarity and its terms; pairs of nodes are (query, view, similarity).
        cut: Where the view was cut to match a silhouette cut by the image border.
    """

    view: ModelView
    terms: ShapeSimilarity
    cut: CutLine | None = None

    @property
    def similarity(self) -> float:
        """0 to 1."""
        return self.terms.similarity

    @property
    def rotation(self) -> float:
        """In-plane rotation from view to query, radians (positive from x towards y, y down).

        For a mirrored match, the rotation from the view's left-right mirror image, which is the silhouette
        from the opposite direction.
        """
        return self.terms.rotation

    @property
    def direction(self) -> tuple[float, float, float] | None:
        """Unit vector from the object to the viewer, model frame; None when unknown.

        In parallel projection the silhouette from behind is the mirror image of the one from the front, so
        a mirrored match indicates the opposite direction.
        """
        if self.view.direction is None or not self.terms.mirrored:
            return self.view.direction
        x, y, z = self.view.direction
        return (-x, -y, -z)


@dataclass(frozen=True, slots=True)
class Ranking:
    """The result of a query.

    Attributes:
        matches: Best first.
        compared: Number of views compared in full.
    """

    matches: tuple[ViewMatch, ...]
    compared: int


@dataclass(frozen=True, slots=True)
class SearchLimits:
    """Limits of a search.

    Attributes:
        top: Number of matches.
        per_name: Most matches of one model; unlimited when None.
        threshold: Least similarity.
        most: Most views compared in full.
        mirror: Whether mirror images count.
    """

    top: int
    per_name: int | None
    threshold: float
    most: int
    mirror: bool

    def best(self, found: Iterable[ViewMatch]) -> list[ViewMatch]:
        """The best matches, at most `per_name` of one model."""
        count_of_model: dict[str, int] = {}
        chosen = []
        for m in sorted(found, key=lambda m: (-m.similarity, m.view.id)):
            count_of_model[m.view.name] = count_of_model.get(m.view.name, 0) + 1
            is_allowed = self.per_name is None or count_of_model[m.view.name] <= self.per_name
            if is_allowed and m.similarity >= self.threshold:
                chosen.append(m)
        return chosen[: self.top]

    def least(self, found: Sequence[ViewMatch], name: str) -> float:
        """The similarity that a further match of a model must exceed to change the result.

        Args:
            found: The best matches so far, best first.
            name: Name of the model.
        """
        least = found[-1].similarity if len(found) >= self.top else self.threshold
        if self.per_name is None:
            return least
        of_model = [m.similarity for m in found if m.view.name == name]
        return max(least, of_model[-1]) if len(of_model) >= self.per_name else least


class ViewSearch:
    """Searches the views of a database.

    Args:
        views: The views.
        shapes: Their shapes.
    """

    def __init__(self, views: Views, shapes: Shapes) -> None:
        self._views = views
        self._shapes = shapes

    @cached_property
    def index(self) -> ViewIndex:
        """The index that selects the likeliest views."""
        rows = self._views.records
        return ViewIndex(self._shapes, summaries=ViewSummaries.read(rows))

    @cached_property
    def _part_index(self) -> ViewIndex:
        return ViewIndex(self._shapes, _PART_WEIGHTS)

    @cached_property
    def _cut_index(self) -> CutIndex:
        return CutIndex(self._shapes)

    def rank_whole(
        self,
        query: Shape,
        among: NDArray[np.intp],
        limits: SearchLimits,
        always_included: NDArray[np.intp] | None = None,
    ) -> Ranking:
        """The views most similar to a shape as it is.

        Args:
            query: The shape.
            among: Numbers of the views to search, ascending.
            limits: Limits.
            always_included: Numbers of views; the likeliest of these are compared as well, as many again.
        """
        candidates = self.index.candidates(query, among, limits.most, always_included)
        shapes = [self._shapes[k] for k in candidates.numbers]
        rigid = ~np.isnan(self._views.records["direction"][candidates.numbers, 0])
        comparison = compare_outlines_and_areas(
            query, shapes, candidates.overlaps, mirror=limits.mirror, rigid=rigid
        )
        share, partial = comparison.shares[:, 0], comparison.partial_similarity
        upper_bounds = share * candidates.bounds + partial
        found: list[ViewMatch] = []
        for n in np.argsort(-upper_bounds, kind="stable"):
            number = int(candidates.numbers[n])
            to_beat = limits.least(found, self._views.name_of(number))
            if upper_bounds[n] < to_beat:
                continue
            graph, root = self._shapes[number].graph, self.index.weights.root
            upper_bound = match_upper_bound(query.graph, graph, candidates.similarities[n], root)
            if share[n] * upper_bound + partial[n] < to_beat:
                continue
            terms = comparison.with_graph(
                int(n), self._match(query, number, candidates.similarities[n])
            )
            found = limits.best([*found, ViewMatch(self._views[number], terms)])
        return Ranking(tuple(found), len(candidates.numbers))

    def _match(self, query: Shape, number: int, similarities: NDArray[np.float32]) -> GraphMatch:
        """Match graphs in a canonical order, so that the result does not depend on the caller."""
        a, b = query.graph, self._shapes[number].graph
        root = self.index.weights.root
        if b.key < a.key:
            return match_nodes(b, a, similarities.T, root).swapped()
        return match_nodes(a, b, similarities, root)

    def rank_cut(self, query: Shape, among: NDArray[np.intp], limits: SearchLimits) -> Ranking:
        """The whole views most similar to a shape cut by the image border.

        Args:
            query: The shape; its border must be known.
            among: Numbers of the whole views to search, ascending.
            limits: Limits.
        """
        border = query.border
        if border is None or not len(among):
            return Ranking((), 0)
        if len(among) > CUT_VIEWS:
            among = self.index.best_overlapping(query, among, CUT_VIEWS)
        map_of_query = query_map(query.contour, border)
        breadth = CUT_BREADTH * limits.most
        candidates = self._cut_index.likeliest(map_of_query, among, breadth, mirror=limits.mirror)
        comparison = self._compare_cut_outlines(query.contour, border, candidates)
        partial = comparison.partial_similarity
        found: list[ViewMatch] = []
        for n in np.argsort(-partial, kind="stable"):
            number, cut = candidates[n]
            to_beat = limits.least(found, self._views.name_of(number))
            if CUT_SHARE * (CUT_SHARES[0] + float(partial[n])) < to_beat:
                continue
            graphs = self._match_part(query, number, cut, to_beat / CUT_SHARE - partial[n])
            terms = comparison.with_graph(int(n), graphs)
            scaled = replace(terms, similarity=round(CUT_SHARE * terms.similarity, 5))
            found = limits.best([*found, ViewMatch(self._views[number], scaled, cut)])
        return Ranking(tuple(found), len(candidates))

    def _compare_cut_outlines(
        self,
        contour: NDArray[np.floating],
        border: float,
        candidates: Sequence[tuple[int, CutLine]],
    ) -> OutlineAreaSimilarities:
        """Outline and area similarities of a cut silhouette with views, each cut by its line."""
        views = [self._shapes[number].contour for number, _ in candidates]
        lines = np.array([(c.bearing, c.offset, c.mirrored) for _, c in candidates]).reshape(-1, 3)
        mirrored = lines[:, 2] > 0
        # The border fixes the rotation.
        rotation = np.where(mirrored, border + lines[:, 0] - np.pi, border - lines[:, 0])
        return OutlineAreaSimilarities(
            compare_cut_outlines(contour, border, views, lines),
            np.array([c.similarity for _, c in candidates]) ** AREA_POWER,
            mirrored,
            np.angle(np.exp(1j * rotation)),
            np.broadcast_to(CUT_SHARES, (len(candidates), 3)),
        )

    def _match_part(self, query: Shape, number: int, cut: CutLine, to_beat: float) -> GraphMatch:
        """The query's graph as a part of a view's, in the view's unit of length.

        Not matched when an upper bound shows that the similarity cannot reach `to_beat`.
        """
        graph = _scaled(query.graph, (1.0 - cut.share) ** 0.5)
        bounds, similarities = self._part_index.bounds(graph, np.array([number]), part=True)
        if CUT_SHARES[0] * bounds[0] < to_beat:
            return GraphMatch(0.0, ())
        return match_nodes(graph, self._shapes[number].graph, similarities[0], 0.0, part=True)


def _scaled(graph: ShockGraph, scale: float) -> ShockGraph:
    """The graph of the same shape in a larger unit."""
    return replace(
        graph,
        lengths=graph.lengths * np.float32(scale),
        profiles=graph.profiles * np.float32(scale),
    )

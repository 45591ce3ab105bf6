"""The search: from a shape to the views that it looks like, best first.

Whole shapes: the index leaves the likeliest views; their areas and outlines are compared at once, then
their shock graphs, until no other view can do better. Shapes that the image border cuts: the views that
look most like it once they are cut in the same way (`truncated_views.py`) are compared likewise, their
graphs as a whole of which the shape is a part.
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
    match_ceiling,
    match_nodes,
)
from visup.percepts.shape.matching.shape_similarity import (
    AREA_POWER,
    Likeness,
    OutlineAreaSimilarities,
    Shape,
    compare_outlines_and_areas,
)
from visup.percepts.shape.matching.truncated_views import CutIndex, CutLine, query_map
from visup.percepts.shape.shocks.shock_graph import ShockGraph

CUT_SHARE = 0.95
"""What a likeness counts for which a whole view had to be cut: where to cut is free to fit."""

CUT_SHARES = (0.05, 0.8, 0.15)
"""Shares of graph, outline and area in that likeness: what a line takes away changes a skeleton most, and the
area has had its say in where to cut."""

CUT_BREADTH = 6
"""Times as many views as of whole silhouettes whose outlines are compared: with the border to begin at, that
is as quick, and a part looks like more things than a whole."""

CUT_VIEWS = 1000
"""Whole views that are cut for one silhouette at most; of more, those whose areas lie best on it."""

_PART_WEIGHTS = MatchWeights(
    kind=0.3, length=0.8, profile=3.5, context=0.0, signature=0.0, root=0.0
)


@dataclass(frozen=True, slots=True)
class ViewMatch:
    """A view that a silhouette looks like.

    Attributes:
        view: The view.
        likeness: How alike the two are, and why; pairs of nodes are (query, view, similarity).
        cut: Where the view was cut to look like a silhouette that the image border cuts.
    """

    view: ModelView
    likeness: Likeness
    cut: CutLine | None = None

    @property
    def similarity(self) -> float:
        """0 to 1."""
        return self.likeness.similarity

    @property
    def rotation(self) -> float:
        """In-plane rotation from view to query, radians (positive from x towards y, y down).

        Of a mirrored match, the rotation from the view's left-right mirror image, which is what is seen
        from the opposite direction.
        """
        return self.likeness.rotation

    @property
    def direction(self) -> tuple[float, float, float] | None:
        """Unit vector from the object to the viewer, model frame; None when it is not known.

        In parallel projection the silhouette from behind is the mirror image of the one from before,
        so that a mirrored match tells of the opposite direction.
        """
        if self.view.direction is None or not self.likeness.mirrored:
            return self.view.direction
        x, y, z = self.view.direction
        return (-x, -y, -z)


@dataclass(frozen=True, slots=True)
class Ranking:
    """The result of a query.

    Attributes:
        matches: Best first.
        compared: How many views were compared in full.
    """

    matches: tuple[ViewMatch, ...]
    compared: int


@dataclass(frozen=True, slots=True)
class SearchLimits:
    """What is wanted of a search.

    Attributes:
        top: How many matches.
        per_name: How many of one model at most; any number when None.
        threshold: Least similarity.
        most: How many views may be compared in full.
        mirror: Whether mirror images count.
    """

    top: int
    per_name: int | None
    threshold: float
    most: int
    mirror: bool

    def best(self, found: Iterable[ViewMatch]) -> list[ViewMatch]:
        """The best matches, no more than so many of one model."""
        seen: dict[str, int] = {}
        kept = []
        for m in sorted(found, key=lambda m: (-m.similarity, m.view.id)):
            seen[m.view.name] = seen.get(m.view.name, 0) + 1
            within = self.per_name is None or seen[m.view.name] <= self.per_name
            if within and m.similarity >= self.threshold:
                kept.append(m)
        return kept[: self.top]

    def least(self, found: Sequence[ViewMatch], name: str) -> float:
        """What a further match of a model must reach to change the result.

        Args:
            found: The best matches so far, best first.
            name: Of the model.
        """
        least = found[-1].similarity if len(found) >= self.top else self.threshold
        if self.per_name is None:
            return least
        own = [m.similarity for m in found if m.view.name == name]
        return max(least, own[-1]) if len(own) >= self.per_name else least


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
        """The sieves that leave the likeliest views."""
        rows = self._views.records
        return ViewIndex(self._shapes, summaries=ViewSummaries.read(rows))

    @cached_property
    def _part_index(self) -> ViewIndex:
        return ViewIndex(self._shapes, _PART_WEIGHTS)

    @cached_property
    def _cut_index(self) -> CutIndex:
        return CutIndex(self._shapes)

    def whole(
        self,
        query: Shape,
        among: NDArray[np.intp],
        wanted: SearchLimits,
        favoured: NDArray[np.intp] | None = None,
    ) -> Ranking:
        """The views that a shape looks like as it is.

        Args:
            query: The shape.
            among: Numbers of the views to be searched, rising.
            wanted: What is wanted.
            favoured: Numbers of views of which as many are compared, whatever the index says.
        """
        likely = self.index.candidates(query, among, wanted.most, favoured)
        shapes = [self._shapes[k] for k in likely.numbers]
        rigid = ~np.isnan(self._views.records["direction"][likely.numbers, 0])
        looks = compare_outlines_and_areas(
            query, shapes, likely.overlaps, mirror=wanted.mirror, rigid=rigid
        )
        share, worth = looks.shares[:, 0], looks.worth
        ceilings = share * likely.bounds + worth
        found: list[ViewMatch] = []
        for n in np.argsort(-ceilings, kind="stable"):
            number = int(likely.numbers[n])
            least = wanted.least(found, self._views.name_of(number))
            if ceilings[n] < least:
                continue
            graph, root = self._shapes[number].graph, self.index.weights.root
            ceiling = match_ceiling(query.graph, graph, likely.similar[n], root)
            if share[n] * ceiling + worth[n] < least:
                continue
            likeness = looks.joined(int(n), self._match(query, number, likely.similar[n]))
            found = wanted.best([*found, ViewMatch(self._views[number], likeness)])
        return Ranking(tuple(found), len(likely.numbers))

    def _match(self, query: Shape, number: int, similar: NDArray[np.float32]) -> GraphMatch:
        """Graphs matched in their own order, so that the result does not depend on who asks."""
        a, b = query.graph, self._shapes[number].graph
        root = self.index.weights.root
        if b.key < a.key:
            return match_nodes(b, a, similar.T, root).turned()
        return match_nodes(a, b, similar, root)

    def cut(self, query: Shape, among: NDArray[np.intp], wanted: SearchLimits) -> Ranking:
        """The whole views that a shape looks like which the image border cuts.

        Args:
            query: The shape; its border must be known.
            among: Numbers of whole views to be searched, rising.
            wanted: What is wanted.
        """
        border = query.border
        if border is None or not len(among):
            return Ranking((), 0)
        if len(among) > CUT_VIEWS:
            among = self.index.best_covered(query, among, CUT_VIEWS)
        own = query_map(query.contour, border)
        breadth = CUT_BREADTH * wanted.most
        likely = self._cut_index.likeliest(own, among, breadth, mirror=wanted.mirror)
        looks = self._cut_looks(query.contour, border, likely)
        worth = looks.worth
        found: list[ViewMatch] = []
        for n in np.argsort(-worth, kind="stable"):
            number, cut = likely[n]
            least = wanted.least(found, self._views.name_of(number))
            if CUT_SHARE * (CUT_SHARES[0] + float(worth[n])) < least:
                continue
            graphs = self._part(query, number, cut, least / CUT_SHARE - worth[n])
            likeness = looks.joined(int(n), graphs)
            lowered = replace(likeness, similarity=round(CUT_SHARE * likeness.similarity, 5))
            found = wanted.best([*found, ViewMatch(self._views[number], lowered, cut)])
        return Ranking(tuple(found), len(likely))

    def _cut_looks(
        self, contour: NDArray[np.floating], border: float, likely: Sequence[tuple[int, CutLine]]
    ) -> OutlineAreaSimilarities:
        """How a cut silhouette's outline and area are like those of views, each cut by its line."""
        views = [self._shapes[number].contour for number, _ in likely]
        lines = np.array([(c.bearing, c.offset, c.mirrored) for _, c in likely]).reshape(-1, 3)
        mirrored = lines[:, 2] > 0
        # The border tells the rotation.
        turned = np.where(mirrored, border + lines[:, 0] - np.pi, border - lines[:, 0])
        return OutlineAreaSimilarities(
            compare_cut_outlines(contour, border, views, lines),
            np.array([c.similarity for _, c in likely]) ** AREA_POWER,
            mirrored,
            np.angle(np.exp(1j * turned)),
            np.broadcast_to(CUT_SHARES, (len(likely), 3)),
        )

    def _part(self, query: Shape, number: int, cut: CutLine, least: float) -> GraphMatch:
        """The query's graph as a part of a view's, in the view's unit of length.

        Where they cannot give so much to the similarity as is needed, nothing is matched.
        """
        graph = _scaled(query.graph, (1.0 - cut.share) ** 0.5)
        bounds, similar = self._part_index.bounds(graph, np.array([number]), part=True)
        if CUT_SHARES[0] * bounds[0] < least:
            return GraphMatch(0.0, ())
        return match_nodes(graph, self._shapes[number].graph, similar[0], 0.0, part=True)


def _scaled(graph: ShockGraph, scale: float) -> ShockGraph:
    """The graph of the same shape in a larger unit."""
    return replace(
        graph,
        lengths=graph.lengths * np.float32(scale),
        profiles=graph.profiles * np.float32(scale),
    )

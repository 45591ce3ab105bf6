"""The model database: names, views and shock graphs, and the search for what a silhouette looks like.

Read `storage.py` for the file itself and `build.py` for what goes into it.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from visup.percepts.shape.catalogue import Shapes, Views
from visup.percepts.shape.compare import (
    GRAPH_SHARE,
    Likeness,
    Shape,
    join,
    outline_similarities,
    shape_of,
)
from visup.percepts.shape.directions import neighbours
from visup.percepts.shape.index import Summaries, ViewIndex
from visup.percepts.shape.match import Match, MatchWeights, in_plane_rotation, match_nodes
from visup.percepts.shape.records import NewView, View
from visup.percepts.shape.shock_graph import ShockGraph
from visup.percepts.shape.silhouette import Silhouette, normalise
from visup.percepts.shape.storage import write_more, write_new

CANDIDATES = 32
"""Views whose outlines are compared when no budget asks for fewer."""

PART_SHARE = 0.55
"""What a perfect match of a cut silhouette with a part of a whole view counts."""

_PART_CANDIDATES = 12
_PART_SCALES = (1.0, 0.8, 0.62, 0.45)
_PART_WEIGHTS = MatchWeights(
    kind=0.3, mass=0.0, length=0.8, profile=3.5, context=0.0, signature=0.0, root=0.0
)


@dataclass(frozen=True, slots=True)
class ViewMatch:
    """A view that a silhouette looks like.

    Attributes:
        view: The view.
        likeness: How alike the two are, and why; pairs of nodes are (query, view, similarity).
        rotation: In-plane rotation from view to query, radians (positive from x towards y, y down), or
            None when the two have too little in common to tell. Of a mirrored match, the rotation from
            the view's left-right mirror image, which is what is seen from the opposite direction.
    """

    view: View
    likeness: Likeness
    rotation: float | None = None

    @property
    def similarity(self) -> float:
        """0 to 1."""
        return self.likeness.similarity

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


class ModelDatabase:
    """Views of models, read from one file; each shape is read when it is first looked at.

    Args:
        path: The file.
        views: What stands in it.
    """

    def __init__(self, path: Path, views: Views) -> None:
        self.path = path
        self.views = views
        self._neighbours: dict[str, list[tuple[int, ...]]] = {}

    @classmethod
    def open(cls, path: Path | str) -> ModelDatabase:
        """Open a database file.

        Raises:
            DatabaseError: Missing, truncated, foreign or of another version.
        """
        return cls(Path(path), Views.read(Path(path)))

    @classmethod
    def create(cls, path: Path | str, views: Iterable[NewView] = ()) -> ModelDatabase:
        """Write a database with these views, in place of whatever stands at the path, and open it.

        Raises:
            DatabaseError: The file cannot be written.
        """
        write_new(Path(path), views)
        return cls.open(path)

    def names(self) -> tuple[str, ...]:
        """Names of the models, in the order of the file."""
        return self.views.names

    @cached_property
    def shapes(self) -> Shapes:
        """Shapes of all views, in the order of `views`; each is read when it is asked for."""
        return Shapes(self.path, self.views)

    @cached_property
    def _index(self) -> ViewIndex:
        rows = self.views.records
        return ViewIndex(self.shapes, summaries=Summaries(rows["root"], rows["sketch"]))

    @cached_property
    def _part_index(self) -> ViewIndex:
        return ViewIndex(self.shapes, _PART_WEIGHTS)

    def neighbours(self, view: View) -> tuple[View, ...]:
        """Views of the same model that are next to a view on the sphere of directions.

        Each view stands for its directions and, mirrored, for the opposite ones.

        Args:
            view: One of this database.

        Returns:
            Its neighbours, rising by number; none when its direction is not known.
        """
        own = self.views.named({view.name})
        if view.name not in self._neighbours:
            self._neighbours[view.name] = neighbours([self.views[k].seen_from for k in own])
        return tuple(self.views[own[k]] for k in self._neighbours[view.name][view.number])

    def add(self, views: Iterable[NewView]) -> ModelDatabase:
        """Add views, to names new or known; the database as it is then. See `build.py`.

        Raises:
            DatabaseError: The file cannot be written; it stays as it was.
        """
        write_more(self.path, views)
        return ModelDatabase.open(self.path)

    def query(
        self,
        shape: NDArray[np.bool_] | Silhouette | Shape,
        *,
        cut: bool = False,
        top: int = 10,
        per_name: int | None = None,
        threshold: float = 0.0,
        restrict: Collection[str] | None = None,
        try_first: Collection[str] = (),
        budget: float = 0.1,
    ) -> Ranking:
        """Rank the views that a shape looks like.

        A cut shape is compared with cut views as it is, and with whole views as a part of them.

        Args:
            shape: A mask (H, W) bool, a silhouette or a shape.
            cut: Whether the image border cuts the mask; a silhouette or shape has its own mark.
            top: How many matches are wanted.
            per_name: How many views of one model may be among them; any number when None.
            threshold: Least similarity.
            restrict: Names that alone are searched; all when None.
            try_first: Names whose likeliest views are compared whatever the index says.
            budget: Share of the views that may be compared in full: at least 16 are, and at most
                `CANDIDATES`. With 1, all are.

        Returns:
            The matches, best first; empty when the mask shows nothing.
        """
        query = as_shape(shape, cut)
        if query is None or not self.views:
            return Ranking((), 0)
        among = self.views.named(restrict)
        most = candidates_wanted(len(self.views), budget)
        wanted = _Wanted(top, per_name, threshold)
        found = self._whole_or_part(query, among, most, frozenset(try_first), wanted)
        matches = tuple(self._with_rotation(query, m) for m in found.matches)
        return Ranking(matches, found.compared)

    def _whole_or_part(
        self,
        query: Shape,
        among: NDArray[np.intp],
        most: int,
        first: frozenset[str],
        wanted: _Wanted,
    ) -> Ranking:
        if not query.cut:
            return self._whole(query, among, most, first, wanted)
        cut_views = self.views.cut[among]
        alike = self._whole(query, among[cut_views], most, first, wanted)
        parts = self._parts(query, among[~cut_views], wanted)
        matches = wanted.best([*alike.matches, *parts.matches])
        return Ranking(tuple(matches), alike.compared + parts.compared)

    def _whole(
        self,
        query: Shape,
        among: NDArray[np.intp],
        most: int,
        first: frozenset[str],
        wanted: _Wanted,
    ) -> Ranking:
        """Candidates by index, their outlines at once, then graphs until no other can do better."""
        favoured = np.intersect1d(self.views.named(first), among) if first else None
        likely = self._index.candidates(query, among, most, favoured)
        outlines, mirrored = outline_similarities(query, [self.shapes[k] for k in likely.numbers])
        ceilings = GRAPH_SHARE * likely.bounds + (1 - GRAPH_SHARE) * outlines
        found: list[ViewMatch] = []
        for n in np.argsort(-ceilings, kind="stable"):
            if ceilings[n] < wanted.least(found):
                break
            number = int(likely.numbers[n])
            graphs = self._match(query, number, likely.similar[n])
            likeness = join(graphs, float(outlines[n]), bool(mirrored[n]))
            found = wanted.best([*found, ViewMatch(self.views[number], likeness)])
        return Ranking(tuple(found), len(likely.numbers))

    def _match(self, query: Shape, number: int, similar: NDArray[np.float32]) -> Match:
        """Graphs matched in their own order, so that the result does not depend on who asks."""
        a, b = query.graph, self.shapes[number].graph
        root = self._index.weights.root
        if b.key < a.key:
            return match_nodes(b, a, similar.T, root).turned()
        return match_nodes(a, b, similar, root)

    def _parts(self, query: Shape, among: NDArray[np.intp], wanted: _Wanted) -> Ranking:
        """The query as a part of whole views, at several sizes of the part within the whole."""
        best: dict[int, Match] = {}
        compared: set[int] = set()
        for scale in _PART_SCALES:
            graph = _scaled(query.graph, scale)
            bounds, similar = self._part_index.bounds(graph, among, part=True)
            for k in np.argsort(-bounds, kind="stable")[:_PART_CANDIDATES]:
                number = int(among[k])
                compared.add(number)
                whole = self.shapes[number].graph
                matched = match_nodes(graph, whole, similar[k], 0.0, part=True)
                if number not in best or matched.similarity > best[number].similarity:
                    best[number] = matched
        found = [
            ViewMatch(self.views[k], Likeness(PART_SHARE * m.similarity, m.similarity, 0.0, m))
            for k, m in best.items()
        ]
        return Ranking(tuple(wanted.best(found)), len(compared))

    def _with_rotation(self, query: Shape, found: ViewMatch) -> ViewMatch:
        own = self.shapes[found.view.id - 1].graph
        likeness = found.likeness
        turn = in_plane_rotation(own, query.graph, likeness.match, mirrored=likeness.mirrored)
        return replace(found, rotation=turn)


@dataclass(frozen=True, slots=True)
class _Wanted:
    """How many matches, how many of one model, and how good they must be."""

    top: int
    per_name: int | None
    threshold: float

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

    def least(self, found: Sequence[ViewMatch]) -> float:
        """What a further match must reach to change the result."""
        return found[-1].similarity if len(found) >= self.top else self.threshold


def candidates_wanted(views: int, budget: float = 0.1) -> int:
    """How many of so many views are compared in full: a share of them, but 16 to `CANDIDATES`."""
    if budget >= 1:
        return views
    return int(min(CANDIDATES, max(16, budget * views)))


def _scaled(graph: ShockGraph, scale: float) -> ShockGraph:
    """The graph of the same shape in a larger unit."""
    return replace(
        graph,
        lengths=graph.lengths * np.float32(scale),
        profiles=graph.profiles * np.float32(scale),
    )


def as_shape(shape: NDArray[np.bool_] | Silhouette | Shape, cut: bool = False) -> Shape | None:
    """The shape of a mask, a silhouette or itself; None when a mask shows nothing."""
    if isinstance(shape, Shape):
        return shape
    silhouette = shape if isinstance(shape, Silhouette) else normalise(shape, cut=cut)
    return None if silhouette is None else shape_of(silhouette)

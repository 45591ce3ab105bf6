"""The model database: names, views and shock graphs, and the search for what a silhouette looks like.

Read `storage.py` for the file itself and `build.py` for what goes into it.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from visup.agent.errors import DatabaseError
from visup.percepts.shape.index import ViewIndex
from visup.percepts.shape.match import Match, in_plane_rotation, match_nodes
from visup.percepts.shape.shock_graph import ShockGraph, shock_graph
from visup.percepts.shape.silhouette import Silhouette, normalise
from visup.percepts.shape.storage import (
    NewView,
    View,
    read_contour,
    read_graphs,
    read_views,
    write_more,
    write_new,
)


@dataclass(frozen=True, slots=True)
class ViewMatch:
    """A view that a silhouette looks like.

    Attributes:
        view: The view.
        similarity: 0 to 1.
        rotation: In-plane rotation from view to query, radians (positive from x towards y, y down), or
            None when the two have too little in common to tell.
        match: The corresponding nodes (query, view, similarity).
    """

    view: View
    similarity: float
    rotation: float | None
    match: Match


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
    """Views of models, read from one file; arrays are read when the first query comes.

    Args:
        path: The file.
        views: What stands in it.
    """

    def __init__(self, path: Path, views: tuple[View, ...]) -> None:
        self.path = path
        self.views = views

    @classmethod
    def open(cls, path: Path | str) -> ModelDatabase:
        """Open a database file.

        Raises:
            DatabaseError: Missing, truncated, foreign or of another version.
        """
        return cls(Path(path), read_views(Path(path)))

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
        return tuple(dict.fromkeys(v.name for v in self.views))

    @cached_property
    def graphs(self) -> tuple[ShockGraph, ...]:
        """Shock graphs of all views, in the order of `views`."""
        found = read_graphs(self.path)
        lost = [v.id for v in self.views if v.id not in found]
        if lost:
            raise DatabaseError(
                f"this model database is damaged: view {lost[0]} has no shock graph",
                where=str(self.path),
                hint="build it anew with 'visup models build'",
            )
        return tuple(found[v.id] for v in self.views)

    @cached_property
    def _index(self) -> ViewIndex:
        return ViewIndex(self.graphs)

    def contour(self, view: View) -> NDArray[np.float32]:
        """The outline of a view in normal form, (N, 2) float32; y down, unit area."""
        return read_contour(self.path, view.id)

    def add(self, views: Iterable[NewView]) -> ModelDatabase:
        """Add views, to names new or known; the database as it is then. See `build.py`.

        Raises:
            DatabaseError: The file cannot be written; it stays as it was.
        """
        write_more(self.path, views)
        return ModelDatabase.open(self.path)

    def query(
        self,
        shape: NDArray[np.bool_] | Silhouette | ShockGraph,
        *,
        cut: bool = False,
        top: int = 10,
        per_name: int | None = None,
        threshold: float = 0.0,
        restrict: Collection[str] | None = None,
        try_first: Collection[str] = (),
        budget: float = 1.0,
    ) -> Ranking:
        """Rank the views that a shape looks like.

        Args:
            shape: A mask (H, W) bool, a silhouette or a shock graph.
            cut: Whether the image border cuts the shape; of a silhouette its own mark counts.
            top: How many matches are wanted.
            per_name: How many views of one model may be among them; any number when None.
            threshold: Least similarity.
            restrict: Names that alone are searched; all when None.
            try_first: Names that are compared in full whatever the index says.
            budget: Share of the views that may be compared in full, those tried first not counted.

        Returns:
            The matches, best first; empty when the mask shows nothing.
        """
        graph = as_graph(shape, cut)
        if graph is None or not self.views:
            return Ranking((), 0)
        among = self._among(restrict)
        bounds, similar = self._index.compare(graph, among)
        most = max(1, round(budget * len(self.views)))
        return self._search(
            graph, among, bounds, similar, top, per_name, threshold, frozenset(try_first), most
        )

    def _among(self, restrict: Collection[str] | None) -> NDArray[np.intp]:
        wanted = [k for k, v in enumerate(self.views) if restrict is None or v.name in restrict]
        return np.array(wanted, dtype=np.intp)

    def _search(
        self,
        graph: ShockGraph,
        among: NDArray[np.intp],
        bounds: NDArray[np.float64],
        similar: list[NDArray[np.float32]],
        top: int,
        per_name: int | None,
        threshold: float,
        first: frozenset[str],
        most: int,
    ) -> Ranking:
        """Compare in full, best bound first, until no bound left can change the result."""
        wanted = [self.views[k].name in first for k in among]
        order = sorted(range(len(among)), key=lambda k: (not wanted[k], -bounds[k], k))
        found: list[ViewMatch] = []
        least, compared = threshold, 0
        for k in order:
            if not wanted[k] and (bounds[k] < least or compared >= most):
                break
            compared += not wanted[k]
            number = int(among[k])
            matched = match_nodes(graph, self.graphs[number], similar[k], self._index.weights.root)
            if matched.similarity < max(threshold, least if not wanted[k] else threshold):
                continue
            found.append(self._view_match(graph, number, matched))
            found = _best(found, top, per_name)
            if len(found) == top:
                least = max(threshold, found[-1].similarity)
        return Ranking(tuple(found), compared + sum(wanted))

    def _view_match(self, graph: ShockGraph, number: int, matched: Match) -> ViewMatch:
        rotation = in_plane_rotation(self.graphs[number], graph, matched)
        return ViewMatch(self.views[number], matched.similarity, rotation, matched)


def _best(found: list[ViewMatch], top: int, per_name: int | None) -> list[ViewMatch]:
    """The best matches, no more than so many of one model."""
    ranked = sorted(found, key=lambda m: (-m.similarity, m.view.id))
    if per_name is None:
        return ranked[:top]
    seen: dict[str, int] = {}
    kept = []
    for m in ranked:
        seen[m.view.name] = seen.get(m.view.name, 0) + 1
        if seen[m.view.name] <= per_name:
            kept.append(m)
    return kept[:top]


def as_graph(
    shape: NDArray[np.bool_] | Silhouette | ShockGraph, cut: bool = False
) -> ShockGraph | None:
    """The shock graph of a mask, a silhouette or itself; None when a mask shows nothing."""
    if isinstance(shape, ShockGraph):
        return shape
    silhouette = shape if isinstance(shape, Silhouette) else normalise(shape, cut=cut)
    return None if silhouette is None else shock_graph(silhouette)

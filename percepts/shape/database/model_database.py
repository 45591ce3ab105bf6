"""The model database: names, views and shapes, and queries by silhouette.

Read `search.py` for the search, `file_format.py` for the file and `database_builder.py` for building it.
"""

from __future__ import annotations

import os
from collections.abc import Collection, Iterable, Mapping, Sequence
from functools import cached_property, lru_cache
from pathlib import Path
from threading import Lock
from typing import Any, TypedDict, Unpack

import numpy as np
from numpy.typing import NDArray

from visup.agent.storage.file_lock import only_writer
from visup.percepts.shape.database.catalogue import Shapes, Views
from visup.percepts.shape.database.file_format import MeshRow, TaughtRow
from visup.percepts.shape.database.file_reader import read_contents
from visup.percepts.shape.database.file_writer import LOCK_NAME, write_more, write_new
from visup.percepts.shape.database.mesh_records import decoded_mesh
from visup.percepts.shape.database.search import Ranking, SearchLimits, ViewMatch, ViewSearch
from visup.percepts.shape.database.taught_records import decoded, encoded
from visup.percepts.shape.database.time_budget import share_within
from visup.percepts.shape.database.view_directions import neighbours
from visup.percepts.shape.index.view_records import ModelView, NewView
from visup.percepts.shape.matching.shape_similarity import Shape, shape_of
from visup.percepts.shape.refinement.mesh_model import MeshModel
from visup.percepts.shape.silhouette.silhouette import Silhouette, looks_cut, normalise
from visup.percepts.taught.taught_view import TaughtView

__all__ = ["ModelDatabase", "Ranking", "ViewMatch", "as_shape", "candidate_count"]

CANDIDATES = 20
"""Views whose outlines are compared, unless a budget allows fewer."""


class QueryOptions(TypedDict, total=False):
    """Options of a ranking.

    Attributes:
        top: Number of matches; default 10.
        per_name: Most views of one model among them; unlimited when None, the default.
        threshold: Least similarity; default 0.
        restrict: The only names to search; all when None, the default.
        try_first: Names whose likeliest views are compared regardless of the index.
        mirror: Whether a view also matches by its mirror image, which is its silhouette from behind;
            default True.
    """

    top: int
    per_name: int | None
    threshold: float
    restrict: Collection[str] | None
    try_first: Collection[str]
    mirror: bool


class ModelDatabase:
    """Views of models in one file; each shape is read on first use.

    Args:
        path: The file.
        views: The views of meshes and silhouettes in it.
        taught: Taught views, as stored.
        meshes: Meshes, as stored.
    """

    def __init__(
        self,
        path: Path,
        views: Views,
        taught: Sequence[TaughtRow] = (),
        meshes: Sequence[MeshRow] = (),
    ) -> None:
        self.path = path
        self.views = views
        self._taught = tuple(taught)
        self._meshes = tuple(meshes)
        self._neighbours: dict[str, list[tuple[int, ...]]] = {}
        self._searching = Lock()  # a search prepares views on first use

    def __getstate__(self) -> dict[str, Any]:
        return {k: v for k, v in vars(self).items() if k != "_searching"}

    def __setstate__(self, state: Mapping[str, Any]) -> None:
        vars(self).update(state, _searching=Lock())

    @classmethod
    def open(cls, path: Path | str) -> ModelDatabase:
        """Open a database file.

        Raises:
            DatabaseError: Missing, truncated, foreign or of another version.
        """
        contents = read_contents(Path(path))
        return cls(Path(path), Views(contents), contents.taught, contents.meshes)

    @classmethod
    def shared(cls, path: Path) -> ModelDatabase:
        """As `open`, but the same database as last time if its file is unchanged.

        What a search prepares of the views takes more than a second, and then serves the next run too.
        """
        try:
            found = path.stat()
        except OSError:
            return cls.open(path)
        version = (found.st_dev, found.st_ino, found.st_size, found.st_mtime_ns)
        # A forked process may not use the file that its parent has open.
        return _last_opened(path, (os.getpid(), *version))

    @classmethod
    def open_or_new(cls, path: Path | str) -> ModelDatabase:
        """Open a database file; create an empty one if there is none.

        Raises:
            DatabaseError: The file is not a valid database, or cannot be written.
        """
        with only_writer(Path(path), LOCK_NAME):
            return cls.open(path) if Path(path).exists() else cls.create(path)

    @classmethod
    def create(
        cls,
        path: Path | str,
        views: Iterable[NewView] = (),
        meshes: Iterable[MeshModel] = (),
    ) -> ModelDatabase:
        """Write a database with these views, replacing any file at the path, and open it.

        Args:
            path: The file.
            views: In the order in which they are numbered.
            meshes: Meshes for pose fitting, at most one per model.

        Raises:
            DatabaseError: The file cannot be written.
        """
        write_new(Path(path), views, meshes=meshes)
        return cls.open(path)

    def names(self) -> tuple[str, ...]:
        """Names of the models, in the order of the file; those only taught come last."""
        return tuple(dict.fromkeys((*self.views.names, *(row.name for row in self._taught))))

    @cached_property
    def taught(self) -> tuple[TaughtView, ...]:
        """Taught views, in the order of teaching.

        Raises:
            DatabaseError: The file is damaged there.
        """
        return tuple(decoded(self.path, k, row) for k, row in enumerate(self._taught))

    @cached_property
    def meshes(self) -> Mapping[str, MeshModel]:
        """Meshes by the names of their models; models of silhouettes have none.

        Raises:
            DatabaseError: The file is damaged there.
        """
        return {row.name: decoded_mesh(self.path, row) for row in self._meshes}

    @cached_property
    def shapes(self) -> Shapes:
        """Shapes of all views, in the order of `views`; each is read on access."""
        return Shapes(self.path, self.views)

    @cached_property
    def _search(self) -> ViewSearch:
        return ViewSearch(self.views, self.shapes)

    def neighbours(self, view: ModelView) -> tuple[ModelView, ...]:
        """Views of the same model adjacent to a view on the sphere of directions.

        Each view covers its directions and, mirrored, the opposite ones.

        Args:
            view: One of this database.

        Returns:
            Its neighbours, ascending by number; none when its direction is unknown.
        """
        of_model = self.views.named({view.name})
        if view.name not in self._neighbours:
            self._neighbours[view.name] = neighbours([self.views[k].seen_from for k in of_model])
        return tuple(self.views[of_model[k]] for k in self._neighbours[view.name][view.number])

    def query_all(
        self,
        shapes: Sequence[NDArray[np.bool_] | Silhouette | Shape],
        *,
        budget_ms: float | None = None,
        budget: float = 0.1,
        **options: Unpack[QueryOptions],
    ) -> tuple[Ranking, ...]:
        """Rank the views for each of several shapes, such as all regions of a frame.

        Args:
            shapes: Masks (H, W) bool not cut by a border, silhouettes or shapes.
            budget_ms: Milliseconds for all shapes on the benchmark machine, shared evenly;
                the likeliest views are compared first. See `time_budget.py`.
            budget: See `query`.
            options: As for `query`, applied to each shape.

        Returns:
            A ranking for each shape.
        """
        if budget_ms is not None and shapes:
            budget = min(budget, share_within(budget_ms / len(shapes), len(self.views)))
        return tuple(self.query(shape, budget=budget, **options) for shape in shapes)

    def add(self, views: Iterable[NewView]) -> ModelDatabase:
        """Add views, to new or known names, and return the updated database.

        Raises:
            DatabaseError: The file cannot be written; it stays as it was.
        """
        write_more(self.path, views)
        return ModelDatabase.open(self.path)

    def teach(self, views: Iterable[TaughtView], *, silhouettes: bool = False) -> ModelDatabase:
        """Add taught views, all or none, and return the updated database.

        Views already present are not added again.

        Args:
            views: Views of new or known objects.
            silhouettes: Whether each outline is also stored as a silhouette view with its shock graph.
                Off by default: taught objects are recognised by appearance, and by shape alone similar
                objects exchange votes and fragments take names.

        Raises:
            DatabaseError: The file cannot be written, or a view is too large; it stays as it was.
        """
        new = {encoded(v).checksum(0): v for v in views}
        with only_writer(self.path, LOCK_NAME):
            # Another process may have taught the same since this database was opened.
            stored = {row.checksum(0) for row in read_contents(self.path).taught}
            not_stored = [view for key, view in new.items() if key not in stored]
            if not not_stored:
                return ModelDatabase.open(self.path)
            silhouette_views = [taught_silhouette(v) for v in not_stored] if silhouettes else []
            write_more(self.path, [s for s in silhouette_views if s is not None], not_stored)
            return ModelDatabase.open(self.path)

    def query(
        self,
        shape: NDArray[np.bool_] | Silhouette | Shape,
        *,
        cut: bool = False,
        budget: float = 0.1,
        **options: Unpack[QueryOptions],
    ) -> Ranking:
        """Rank the views by similarity to a shape.

        A cut shape is compared with cut views as it is, and with whole views after cutting them in the same
        way; if the position of its border is unknown, with all views as it is.

        Args:
            shape: A mask (H, W) bool, a silhouette or a shape.
            cut: Whether the image border cuts the mask; silhouettes and shapes have their own flag.
            budget: Share of the views that may be compared in full: at least 16 are (4 when less than
                the default tenth is asked for), and at most `CANDIDATES`. With 1, all are.
            options: See `QueryOptions`.

        Returns:
            The matches, best first; empty when the mask has no shape.
        """
        query = as_shape(shape, cut)
        if query is None or not self.views:
            return Ranking((), 0)
        among = self.views.named(options.get("restrict"))
        most_compared = candidate_count(len(self.views), budget)
        limits = SearchLimits(
            options.get("top", 10),
            options.get("per_name"),
            options.get("threshold", 0.0),
            most_compared,
            options.get("mirror", True),
        )
        first = options.get("try_first")
        always_included = np.intersect1d(self.views.named(first), among) if first else None
        with self._searching:
            if not query.cut or query.border is None:
                return self._search.rank_whole(query, among, limits, always_included)
            is_cut = self.views.cut[among]
            whole_matches = self._search.rank_whole(query, among[is_cut], limits, always_included)
            cut_matches = self._search.rank_cut(query, among[~is_cut], limits)
        matches = limits.best([*whole_matches.matches, *cut_matches.matches])
        return Ranking(tuple(matches), whole_matches.compared + cut_matches.compared)


@lru_cache(maxsize=1)
def _last_opened(path: Path, version: tuple[int, ...]) -> ModelDatabase:
    """A database, cached while its file has this version."""
    return ModelDatabase.open(path)


def candidate_count(views: int, budget: float = 0.1) -> int:
    """Number of `views` compared in full: a share of them, within limits (see `query`)."""
    if budget >= 1:
        return views
    return int(min(CANDIDATES, max(16 if budget >= 0.1 else 4, budget * views)))


def taught_silhouette(view: TaughtView) -> NewView | None:
    """A taught outline as a silhouette view; None when it has no shape."""
    shape = as_shape(view.mask, looks_cut(view.mask))
    return None if shape is None else NewView(view.name.strip(), None, None, shape)


def as_shape(shape: NDArray[np.bool_] | Silhouette | Shape, cut: bool = False) -> Shape | None:
    """The shape of a mask or silhouette, or itself; None when a mask has no shape."""
    if isinstance(shape, Shape):
        return shape
    silhouette = shape if isinstance(shape, Silhouette) else normalise(shape, cut=cut)
    return None if silhouette is None else shape_of(silhouette)

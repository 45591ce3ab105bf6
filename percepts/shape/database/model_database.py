"""The model database: names, views and shapes, and what a silhouette looks like of them.

Read `search.py` for the search, `file_format.py` for the file and `database_builder.py` for what goes
into it.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import TypedDict, Unpack

import numpy as np
from numpy.typing import NDArray

from visup.agent.storage.file_lock import only_writer
from visup.percepts.shape.database.catalogue import Shapes, Views
from visup.percepts.shape.database.file_format import MeshRow, TaughtRow
from visup.percepts.shape.database.file_reader import read_contents
from visup.percepts.shape.database.file_writer import WHAT, write_more, write_new
from visup.percepts.shape.database.mesh_records import decoded_mesh
from visup.percepts.shape.database.search import Ranking, SearchLimits, ViewMatch, ViewSearch
from visup.percepts.shape.database.taught_records import decoded, encoded
from visup.percepts.shape.database.time_budget import share_within
from visup.percepts.shape.database.view_directions import neighbours
from visup.percepts.shape.index.view_records import ModelView, NewView
from visup.percepts.shape.matching.shape_similarity import Shape, shape_of
from visup.percepts.shape.refinement.mesh_model import MeshModel
from visup.percepts.shape.silhouette.silhouette import Silhouette, looks_cut, normalise
from visup.percepts.taught.view import TaughtView

__all__ = ["ModelDatabase", "Ranking", "ViewMatch", "as_shape", "candidates_wanted"]

CANDIDATES = 20
"""Views whose outlines are compared when no budget asks for fewer."""


class QueryOptions(TypedDict, total=False):
    """What may be asked of a ranking.

    Attributes:
        top: How many matches are wanted; 10 unless told.
        per_name: How many views of one model may be among them; any number when None, as usual.
        threshold: Least similarity; 0 unless told.
        restrict: Names that alone are searched; all when None, as usual.
        try_first: Names whose likeliest views are compared whatever the index says.
        mirror: Whether a view is also recognised by its mirror image, which is what is seen from
            behind; so unless told.
    """

    top: int
    per_name: int | None
    threshold: float
    restrict: Collection[str] | None
    try_first: Collection[str]
    mirror: bool


class ModelDatabase:
    """Views of models, read from one file; each shape is read when it is first looked at.

    Args:
        path: The file.
        views: The views of meshes and silhouettes that stand in it.
        taught: What was taught, as it stands in it.
        meshes: Meshes, as they stand in it.
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

    @classmethod
    def open(cls, path: Path | str) -> ModelDatabase:
        """Open a database file.

        Raises:
            DatabaseError: Missing, truncated, foreign or of another version.
        """
        contents = read_contents(Path(path))
        return cls(Path(path), Views(contents), contents.taught, contents.meshes)

    @classmethod
    def open_or_new(cls, path: Path | str) -> ModelDatabase:
        """Open a database file; where none is, one without views is written.

        Raises:
            DatabaseError: What is there is no sound database, or none can be written there.
        """
        with only_writer(Path(path), WHAT):
            return cls.open(path) if Path(path).exists() else cls.create(path)

    @classmethod
    def create(
        cls,
        path: Path | str,
        views: Iterable[NewView] = (),
        meshes: Iterable[MeshModel] = (),
    ) -> ModelDatabase:
        """Write a database with these views, in place of whatever stands at the path, and open it.

        Args:
            path: Where.
            views: In the order in which they are numbered.
            meshes: What the poses of models are fitted with, each model's once.

        Raises:
            DatabaseError: The file cannot be written.
        """
        write_new(Path(path), views, meshes=meshes)
        return cls.open(path)

    def names(self) -> tuple[str, ...]:
        """Names of the models, in the order of the file; those that were only taught come last."""
        return tuple(dict.fromkeys((*self.views.names, *(row.name for row in self._taught))))

    @cached_property
    def taught(self) -> tuple[TaughtView, ...]:
        """What was taught, in the order of teaching.

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
        """Shapes of all views, in the order of `views`; each is read when it is asked for."""
        return Shapes(self.path, self.views)

    @cached_property
    def _search(self) -> ViewSearch:
        return ViewSearch(self.views, self.shapes)

    def neighbours(self, view: ModelView) -> tuple[ModelView, ...]:
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

    def query_all(
        self,
        shapes: Sequence[NDArray[np.bool_] | Silhouette | Shape],
        *,
        budget_ms: float | None = None,
        budget: float = 0.1,
        **options: Unpack[QueryOptions],
    ) -> tuple[Ranking, ...]:
        """Rank the views that each of several shapes looks like, such as all regions of a frame.

        Args:
            shapes: Masks (H, W) bool of what no border cuts, silhouettes or shapes.
            budget_ms: Milliseconds for all together on the machine of the benchmarks, shared evenly;
                the likeliest views are compared first. See `time_budget.py`.
            budget: See `query`.
            options: For each shape, as for `query`.

        Returns:
            A ranking for each shape.
        """
        if budget_ms is not None and shapes:
            budget = min(budget, share_within(budget_ms / len(shapes), len(self.views)))
        return tuple(self.query(shape, budget=budget, **options) for shape in shapes)

    def add(self, views: Iterable[NewView]) -> ModelDatabase:
        """Add views, to names new or known; the database as it is then. See `database_builder.py`.

        Raises:
            DatabaseError: The file cannot be written; it stays as it was.
        """
        write_more(self.path, views)
        return ModelDatabase.open(self.path)

    def teach(self, views: Iterable[TaughtView], *, silhouettes: bool = False) -> ModelDatabase:
        """Add what was taught, all of it or nothing; the database as it is then.

        A view that is there already is not added once more.

        Args:
            views: Of things new or known.
            silhouettes: Whether each outline is stored as a view of a silhouette besides, with its shock
                graph. Not unless told: what was taught is recognised by its appearance, and by
                shape alone things that look alike lend each other votes, and fragments take names.

        Raises:
            DatabaseError: The file cannot be written, or a view is too large; it stays as it was.
        """
        new = {encoded(v).checksum(0): v for v in views}
        with only_writer(self.path, WHAT):
            # Somebody else may have taught the same since this database was opened.
            known = {row.checksum(0) for row in read_contents(self.path).taught}
            fresh = [view for key, view in new.items() if key not in known]
            if not fresh:
                return ModelDatabase.open(self.path)
            seen = [taught_silhouette(v) for v in fresh] if silhouettes else []
            write_more(self.path, [s for s in seen if s is not None], fresh)
            return ModelDatabase.open(self.path)

    def query(
        self,
        shape: NDArray[np.bool_] | Silhouette | Shape,
        *,
        cut: bool = False,
        budget: float = 0.1,
        **options: Unpack[QueryOptions],
    ) -> Ranking:
        """Rank the views that a shape looks like.

        A cut shape is compared with cut views as it is, and with whole views as they look when they are
        cut in the same way; one of which it is not known where the border lies, as it is.

        Args:
            shape: A mask (H, W) bool, a silhouette or a shape.
            cut: Whether the image border cuts the mask; a silhouette or shape has its own mark.
            budget: Share of the views that may be compared in full: at least 16 are (4 when less than
                the usual tenth is asked for), and at most `CANDIDATES`. With 1, all are.
            options: See `QueryOptions`.

        Returns:
            The matches, best first; empty when the mask shows nothing.
        """
        query = as_shape(shape, cut)
        if query is None or not self.views:
            return Ranking((), 0)
        among = self.views.named(options.get("restrict"))
        most = candidates_wanted(len(self.views), budget)
        wanted = SearchLimits(
            options.get("top", 10),
            options.get("per_name"),
            options.get("threshold", 0.0),
            most,
            options.get("mirror", True),
        )
        first = options.get("try_first")
        favoured = np.intersect1d(self.views.named(first), among) if first else None
        if not query.cut or query.border is None:
            return self._search.whole(query, among, wanted, favoured)
        cut_views = self.views.cut[among]
        alike = self._search.whole(query, among[cut_views], wanted, favoured)
        parts = self._search.cut(query, among[~cut_views], wanted)
        matches = wanted.best([*alike.matches, *parts.matches])
        return Ranking(tuple(matches), alike.compared + parts.compared)


def candidates_wanted(views: int, budget: float = 0.1) -> int:
    """How many of so many views are compared in full: a share of them, within limits (see `query`)."""
    if budget >= 1:
        return views
    return int(min(CANDIDATES, max(16 if budget >= 0.1 else 4, budget * views)))


def taught_silhouette(view: TaughtView) -> NewView | None:
    """The silhouette of a taught outline as a view; None when it has no shape."""
    shape = as_shape(view.mask, looks_cut(view.mask))
    return None if shape is None else NewView(view.name.strip(), None, None, shape)


def as_shape(shape: NDArray[np.bool_] | Silhouette | Shape, cut: bool = False) -> Shape | None:
    """The shape of a mask, a silhouette or itself; None when a mask shows nothing."""
    if isinstance(shape, Shape):
        return shape
    silhouette = shape if isinstance(shape, Silhouette) else normalise(shape, cut=cut)
    return None if silhouette is None else shape_of(silhouette)

"""Shape retrieval: leave-one-out over classes of silhouettes.

Figures are defined in the data's README. The main figures are for the complete method (shock graphs, then
outlines and areas); `graph_alone` is the shock graph only.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from visup.agent.model.errors import SettingsError
from visup.evaluation.figures import Progress, silent
from visup.evaluation.workers import worker_pool
from visup.percepts.shape.building.database_builder import IMAGE_SUFFIXES, read_silhouette
from visup.percepts.shape.database.model_database import candidate_count
from visup.percepts.shape.index.view_index import ViewIndex
from visup.percepts.shape.matching.graph_matching import WEIGHTS, match_nodes
from visup.percepts.shape.matching.shape_similarity import (
    GRAPH_SHARE,
    Shape,
    compare_outlines_and_areas,
    shape_of,
)
from visup.percepts.shape.silhouette.area_overlap import AreaIndex
from visup.percepts.shape.silhouette.silhouette import normalise

RANKS = 10
"""Number of ranks in the rank table."""

_PROCESSES = 2
_ROWS_PER_TASK = 20


@dataclass(frozen=True, slots=True, eq=False)
class _Rows:
    """Similarities of some queries with all previous shapes."""

    rows: list[int]
    graphs: list[NDArray[np.float64]]
    outlines: list[NDArray[np.float64]]
    seconds: float


def evaluate_shapes(
    folder: Path, *, limit: int | None = None, progress: Progress = silent
) -> dict[str, Any]:
    """Leave-one-out figures over `<class>/*.png` below a folder.

    Args:
        folder: Folder of classes. The polarity of the images is detected.
        limit: Maximum shapes of each class; all by default.
        progress: Shows what is being done.

    Returns:
        {"total": {...}, "items": {class: {...}}}: shares `nn1`, `bullseye`, `lost` and `compared` are
        0 to 1; `ranks` counts queries with a shape of their class at ranks 1 to 10 and `rank_sum` is
        their sum; `ms_shape` and `ms_pair` are milliseconds in one process; `graph_alone` holds
        `nn1`, `ranks`, `rank_sum`, `bullseye` of the shock graph by itself.

    Raises:
        SettingsError: There are no classes with at least two shapes in all.
    """
    labels, files = _list_images(folder, limit)
    shapes, ms_shape = _shapes(files, progress)
    graphs, outlines, ms_pair = _similarities(shapes, progress)
    similarities = GRAPH_SHARE * graphs + outlines
    np.fill_diagonal(similarities, 1.0)
    compared, lost = _prune(shapes, similarities)
    items = _figures(similarities, labels)
    graph_alone = _figures(graphs, labels)
    for name, figures in items.items():
        figures["graph_alone"] = graph_alone[name]
        own = labels == name if name else np.ones(len(labels), dtype=bool)
        figures["compared"], figures["lost"] = float(compared[own].mean()), float(lost[own].mean())
    total = items.pop("")
    return {"total": {**total, "ms_shape": ms_shape, "ms_pair": ms_pair}, "items": items}


def _list_images(folder: Path, limit: int | None) -> tuple[NDArray[np.str_], list[Path]]:
    """Classes and image files by name."""
    images = [
        (class_folder.name, file)
        for class_folder in sorted(p for p in folder.iterdir() if p.is_dir())
        for file in sorted(f for f in class_folder.iterdir() if f.suffix.lower() in IMAGE_SUFFIXES)[
            :limit
        ]
    ]
    if len(images) < 2:
        raise SettingsError(
            "there are no shapes to compare here",
            where=str(folder),
            expected="<class>/*.png with at least two pictures",
        )
    return np.array([name for name, _ in images]), [file for _, file in images]


def _shapes(files: Sequence[Path], progress: Progress) -> tuple[list[Shape], float]:
    """Shapes of all images, and milliseconds per shape from mask to shock graph."""
    progress(f"{len(files)} silhouettes")
    seconds, shapes = [], []
    for file in files:
        mask = read_silhouette(file)
        begin = time.perf_counter()
        silhouette = normalise(mask)
        if silhouette is None:
            raise SettingsError("this picture shows no shape", where=str(file))
        shapes.append(shape_of(silhouette))
        seconds.append(time.perf_counter() - begin)
    return shapes, 1e3 * float(np.median(seconds))


def _similarities(
    shapes: list[Shape], progress: Progress
) -> tuple[NDArray[np.float64], NDArray[np.float64], float]:
    """Graph similarities of all pairs, the contribution of outlines and areas, and milliseconds per pair."""
    size = len(shapes)
    graphs, outlines = np.eye(size), np.eye(size)
    begins = list(range(1, size, _ROWS_PER_TASK))
    seconds = 0.0
    with worker_pool(_PROCESSES, _set_shapes, shapes) as pool:
        for batch in pool.map(_compare_rows, begins):
            seconds += batch.seconds
            for i, g, o in zip(batch.rows, batch.graphs, batch.outlines, strict=True):
                graphs[i, :i] = graphs[:i, i] = g
                outlines[i, :i] = outlines[:i, i] = o
            progress(f"{batch.rows[-1] + 1} of {size} queries")
    return graphs, outlines, 1e3 * seconds / (size * (size - 1) / 2)


class _Shared:
    """Data of each pool process."""

    shapes: list[Shape]
    index: ViewIndex
    areas: AreaIndex


def _set_shapes(shapes: list[Shape]) -> None:
    _Shared.shapes = shapes
    _Shared.index = ViewIndex(shapes)
    _Shared.areas = AreaIndex(np.stack([s.areas for s in shapes]))
    for shape in shapes:
        _ = shape.heights


def _compare_rows(begin: int) -> _Rows:
    start = time.perf_counter()
    rows = list(range(begin, min(begin + _ROWS_PER_TASK, len(_Shared.shapes))))
    graphs = [_graph_row(i) for i in rows]
    outlines = [_outline_row(i) for i in rows]
    return _Rows(rows, graphs, outlines, time.perf_counter() - start)


def _graph_row(i: int) -> NDArray[np.float64]:
    """Similarities of one graph with all previous ones, each pair in order."""
    query = _Shared.shapes[i].graph
    _, similar = _Shared.index.bounds(query, np.arange(i))
    out = np.empty(i)
    for j in range(i):
        other = _Shared.shapes[j].graph
        if other.key < query.key:
            out[j] = match_nodes(other, query, similar[j].T, WEIGHTS.root).similarity
        else:
            out[j] = match_nodes(query, other, similar[j], WEIGHTS.root).similarity
    return out


def _outline_row(i: int) -> NDArray[np.float64]:
    """The contribution of outlines and areas to the similarities of one shape with all previous ones."""
    query = _Shared.shapes[i]
    overlaps = _Shared.areas.overlaps(query.areas, np.arange(i))
    return compare_outlines_and_areas(query, _Shared.shapes[:i], overlaps).partial_similarity


def _prune(
    shapes: list[Shape], similarities: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """For each query the share of the others that passes the index, and 1 if the best is lost."""
    index = ViewIndex(shapes)
    indices = np.arange(len(shapes))
    limit = candidate_count(len(shapes) - 1)
    compared, lost = np.zeros(len(shapes)), np.zeros(len(shapes))
    for i, shape in enumerate(shapes):
        others = indices[indices != i]
        candidates = index.candidates(shape, others, limit).numbers
        compared[i] = len(candidates) / len(others)
        lost[i] = float(others[int(np.argmax(similarities[i, others]))] not in candidates)
    return compared, lost


def _figures(
    similarity: NDArray[np.float64], labels: NDArray[np.str_]
) -> dict[str, dict[str, Any]]:
    """Figures for each class, and for all under an empty name."""
    hits, bullseye = np.zeros((len(labels), RANKS), dtype=int), np.zeros(len(labels))
    for i, label in enumerate(labels):
        order = np.argsort(-similarity[i], kind="stable")
        class_size = int((labels == label).sum())
        # The query itself is among its best matches; ties must not displace it.
        others = order[order != i]
        ranked = labels[others[:RANKS]] == label
        hits[i, : len(ranked)] = ranked
        retrieved = np.concatenate([[i], others])[: 2 * class_size]
        bullseye[i] = (labels[retrieved] == label).sum() / class_size
    groups = {
        "": np.ones(len(labels), dtype=bool),
        **{str(c): labels == c for c in np.unique(labels)},
    }
    return {name: _summary(hits[own], bullseye[own]) for name, own in groups.items()}


def _summary(hits: NDArray[np.int_], bullseye: NDArray[np.float64]) -> dict[str, Any]:
    ranks = [int(h) for h in hits.sum(axis=0)]
    return {
        "nn1": float(hits[:, 0].mean()),
        "ranks": ranks,
        "rank_sum": sum(ranks),
        "bullseye": float(bullseye.mean()),
    }

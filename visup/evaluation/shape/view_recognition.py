"""Recognition of views: silhouettes from unseen directions against a database of views of all models.

Figures are defined in the data's README (`visup eval views`). The direction of a view is compared with all
directions from which the true object looks the same (`symmetry.py`).
"""

from __future__ import annotations

import os
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypedDict, Unpack

import numpy as np
from numpy.typing import NDArray

from visup.agent.model.errors import SettingsError
from visup.evaluation.figures import Progress, silent
from visup.evaluation.shape.descriptors import Descriptor, descriptors, nearest
from visup.evaluation.shape.symmetry import angle_to, silhouette_symmetries
from visup.evaluation.shape.view_queries import CONDITIONS, Query, draw_queries
from visup.percepts.shape.building.database_builder import build_database
from visup.percepts.shape.building.mesh_views import half_sphere_directions, load_mesh, render_views
from visup.percepts.shape.database.model_database import ModelDatabase, ViewMatch
from visup.rules.identity.votes import VoteSettings

UNKNOWN_SIMILARITY = VoteSettings().unknown_similarity
"""Similarity above which a name gets more votes than "none of the models"."""

TOP = 5
"""Number of distinct objects for `top5`."""

MESHES = (".ply", ".stl", ".obj", ".off", ".glb")
"""Suffixes of mesh files."""


@dataclass(frozen=True, slots=True)
class _QueryResult:
    """The result of one query in one condition."""

    name: str
    condition: str
    rank: int | None
    angle: float | None
    seconds: float
    compared: float
    own: float
    other: float


class QuerySettings(TypedDict, total=False):
    """Settings of the queries.

    Attributes:
        queries: Queries per mesh; 12 by default.
        seed: Random seed; 0 by default.
    """

    queries: int
    seed: int


def evaluate_views(
    folder: Path,
    *,
    views: int = 32,
    limit: int | None = None,
    machines: bool = False,
    progress: Progress = silent,
    **query_settings: Unpack[QuerySettings],
) -> dict[str, Any]:
    """Figures of recognising meshes from unseen directions.

    Args:
        folder: Folder of mesh files.
        views: Views of each mesh in the database.
        limit: Maximum meshes of the folder; all by default.
        machines: Whether to add the generated machines (`render/meshes/machines.py`).
        progress: Shows what is being done.
        query_settings: Settings of the queries.

    Returns:
        {"total": {...}, "items": {mesh: {...}}}: for each of `clean`, `noise`, `cut` and `both`, `top1`
        and `top5` (shares of queries whose object is the first of all, or among the five best) and
        `angle_deg` (median angle between the best view of the right object and the true direction),
        `known_told` and `stranger_told` (shares of queries in which the right object, or without it in
        the database the best other one, is as similar as counts for more than nothing known does) and
        `ms` (median); `ms_query` from mask to ranking, the mean of the four conditions, `compared` as a
        share of all views, `build_views_per_s`; under `baseline`, `top1` of other descriptors on the same
        views and queries.

    Raises:
        SettingsError: There are no meshes, or a number is out of range.
        ExtraMissingError: The mesh renderer or the baselines are not installed.
    """
    queries, seed = query_settings.get("queries", 12), query_settings.get("seed", 0)
    if views < 1 or queries < 1:
        raise SettingsError("views and queries are counted from 1", expected="at least 1 of each")
    meshes = _mesh_files(folder, limit)
    baseline_descriptors = descriptors()
    with tempfile.TemporaryDirectory() as scratch:
        meshes += _machines(Path(scratch)) if machines else []
        progress(f"views of {len(meshes)} meshes")
        begin = time.perf_counter()
        database = build_database(
            Path(scratch) / "views.models", meshes, views=views, jobs=os.cpu_count() or 1
        )
        rate = len(meshes) * views / (time.perf_counter() - begin)
        drawn = list(_queries_with_symmetries(meshes, queries, seed, progress))
        results = [a for query, alike in drawn for a in _query_results(database, query, alike)]
        progress("other descriptors")
        baseline = _baselines(baseline_descriptors, meshes, views, [query for query, _ in drawn])
    items = {m.stem: _figures([a for a in results if a.name == m.stem]) for m in meshes}
    total = {**_figures(results), "build_views_per_s": rate, "baseline": baseline}
    return {"total": total, "items": items}


def _mesh_files(folder: Path, limit: int | None) -> list[Path]:
    files = sorted(p for p in folder.iterdir() if p.suffix.lower() in MESHES)[:limit]
    if not files:
        raise SettingsError(
            "there are no meshes here",
            where=str(folder),
            expected=f"mesh files ({', '.join(MESHES)})",
        )
    return files


def _machines(folder: Path) -> list[Path]:
    """The generated machines as mesh files in a folder."""
    from visup.render.meshes.machines import MACHINES
    from visup.render.meshes.spacecraft import write_meshes

    return write_meshes(MACHINES, folder)


def _queries_with_symmetries(
    meshes: Sequence[Path], queries: int, seed: int, progress: Progress
) -> Iterator[tuple[Query, NDArray[np.float64]]]:
    """All queries with the symmetries of their objects."""
    for path in meshes:
        progress(f"{path.stem}: {queries} queries")
        mesh = load_mesh(path)
        symmetries = silhouette_symmetries(mesh)
        for query in draw_queries(path.stem, mesh, queries, seed):
            yield query, symmetries


def _query_results(
    database: ModelDatabase, query: Query, symmetries: NDArray[np.float64]
) -> Iterator[_QueryResult]:
    """One query in all conditions."""
    for condition in CONDITIONS:
        mask, cut = query.masks[condition], condition in ("cut", "both")
        begin = time.perf_counter()
        ranking = database.query(mask, cut=cut, top=TOP, per_name=1)
        seconds = time.perf_counter() - begin
        names = [m.view.name for m in ranking.matches]
        matches = database.query(mask, cut=cut, top=1, restrict={query.name}).matches
        yield _QueryResult(
            query.name,
            condition,
            names.index(query.name) if query.name in names else None,
            _angle(matches, query, symmetries),
            seconds,
            ranking.compared / len(database.views),
            matches[0].similarity if matches else 0.0,
            max((m.similarity for m in ranking.matches if m.view.name != query.name), default=0.0),
        )


def _angle(
    matches: Sequence[ViewMatch], query: Query, symmetries: NDArray[np.float64]
) -> float | None:
    if not matches or matches[0].direction is None:
        return None
    return angle_to(np.asarray(matches[0].direction), query.direction, symmetries)


def _figures(results: Sequence[_QueryResult]) -> dict[str, Any]:
    figures: dict[str, Any] = {}
    for condition in CONDITIONS:
        own = [a for a in results if a.condition == condition]
        angles = [a.angle for a in own if a.angle is not None]
        figures[condition] = {
            "top1": float(np.mean([a.rank == 0 for a in own])),
            "top5": float(np.mean([a.rank is not None for a in own])),
            "angle_deg": float(np.median(angles)) if angles else None,
            "known_told": float(np.mean([a.own >= UNKNOWN_SIMILARITY for a in own])),
            "stranger_told": float(np.mean([a.other >= UNKNOWN_SIMILARITY for a in own])),
            "ms": 1e3 * float(np.median([a.seconds for a in own])),
        }
    figures["ms_query"] = float(np.mean([figures[c]["ms"] for c in CONDITIONS]))
    figures["compared"] = float(np.mean([a.compared for a in results]))
    return figures


def _baselines(
    descriptors_by_name: dict[str, Descriptor],
    meshes: Sequence[Path],
    views: int,
    queries: Sequence[Query],
) -> dict[str, dict[str, float]]:
    """Share of queries whose nearest view, by each baseline descriptor, is of the right object."""
    known_views = [
        (path.stem, v.mask)
        for path in meshes
        for v in render_views(load_mesh(path), half_sphere_directions(views))
    ]
    names = [name for name, _ in known_views]
    table: dict[str, dict[str, float]] = {}
    for name, describe in descriptors_by_name.items():
        vectors = np.stack([describe(mask) for _, mask in known_views])
        table[name] = {
            condition: float(
                np.mean(
                    [
                        names[nearest(vectors, describe(q.masks[condition]))[0]] == q.name
                        for q in queries
                    ]
                )
            )
            for condition in CONDITIONS
        }
    return table

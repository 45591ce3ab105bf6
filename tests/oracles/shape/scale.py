"""How a model database does when it grows: opening, answering, memory, and what the index loses.

Views of meshes are multiplied by deformation (`augment.py`); each size is measured in a process of its
own, so that its memory is that of the database. What is lost is told against exhaustive search.
"""

from __future__ import annotations

import json
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from tests.oracles.shape.augment import augmented
from visup.agent.model.errors import SettingsError
from visup.evaluation.figures import Progress, silent
from visup.evaluation.oracles import CHECKOUT
from visup.percepts.shape.building.database_builder import build_database
from visup.percepts.shape.building.mesh_views import load_mesh, render_views, sphere_directions
from visup.percepts.shape.database.model_database import ModelDatabase
from visup.percepts.shape.matching.shape_similarity import Shape, shape_of
from visup.percepts.shape.silhouette.silhouette import normalise

VIEWS_OF_A_MESH = 16
SIZES = (1, 10)
"""Sizes that are measured, in multiples of the database of the meshes."""

QUERIES = 2
"""Queries for each mesh: one clean, one with a noisy contour, from directions of no view."""

_NOISE_PX = 2.0
_WANTED = 8

# Pairs that exhaustive search may compare: among many views fewer queries are searched so.
_EXHAUSTIVE = 60_000


def evaluate_scale(
    folder: Path,
    *,
    most: int = 100_000,
    seed: int = 0,
    jobs: int = 2,
    progress: Progress = silent,
) -> dict[str, Any]:
    """Measure databases of a folder's meshes, as they are, ten times as large, and as large as asked.

    Args:
        folder: Meshes, `*.ply`.
        most: Views of the largest database.
        seed: Of the deformations and of the queries.
        jobs: Processes that build the database of the meshes.
        progress: Shows what is being done.

    Returns:
        `items` by number of views, each with `open_ms`, `first_ms` (the first query), `ms_query` (median
        from mask to ranked list), `ms_search` (the database's part of it), `ms_cpu` (the processor's
        time for it, which other programs do not lengthen), `ms_worst`, `rss_mb`,
        `compared` (share of views) and, up to ten times the meshes' views, `lost` (share of exhaustive
        search's best matches; among many views, of a sample of the queries); `total` with
        `build_views_per_s` and `slower` (time of a query with ten times the views by the time with
        once the views).

    Raises:
        SettingsError: There are no meshes.
    """
    meshes = sorted(folder.glob("*.ply"))
    if not meshes:
        raise SettingsError("there are no meshes here", where=str(folder), expected="*.ply")
    with tempfile.TemporaryDirectory() as scratch:
        progress(f"{len(meshes)} meshes")
        begin = time.perf_counter()
        base = build_database(Path(scratch) / "base.db", meshes, views=VIEWS_OF_A_MESH, jobs=jobs)
        rate = len(base.views) / (time.perf_counter() - begin)
        masks = Path(scratch) / "masks.npz"
        np.savez_compressed(masks, *query_masks(meshes, seed))
        items: dict[str, Any] = {}
        counts = [len(base.views) * k for k in SIZES]
        for views in (*counts, *([most] if most > counts[-1] else [])):
            path = Path(scratch) / f"{views}.db"
            augmented(base, path, views, seed, progress)
            progress(f"queries among {views} views")
            items[f"{views} views"] = _probed(path, masks, exhaustive=views in counts)
            path.unlink()
    once, ten = (items[f"{views} views"]["ms_cpu"] for views in counts)
    return {"items": items, "total": {"build_views_per_s": rate, "slower": ten / once}}


def query_masks(meshes: Sequence[Path], seed: int) -> list[NDArray[np.bool_]]:
    """Silhouettes of meshes from directions of no view: clean ones and ones with noisy contours."""
    rng = np.random.default_rng(seed)
    out = []
    for mesh in meshes:
        directions = sphere_directions(QUERIES, int(rng.integers(1, 2**31)))
        for number, seen in enumerate(render_views(load_mesh(mesh), directions)):
            out.append(seen.mask if number % 2 == 0 else noisy(seen.mask, _NOISE_PX, rng))
    return out


def noisy(mask: NDArray[np.bool_], sigma: float, rng: np.random.Generator) -> NDArray[np.bool_]:
    """A mask whose contour is moved in and out by so many pixels, smoothly along it."""
    field = cv2.GaussianBlur(rng.normal(size=mask.shape).astype(np.float32), (0, 0), 3.0)
    field = field * np.float32(sigma / max(float(field.std()), 1e-6))
    inside = cv2.distanceTransform(mask.astype(np.uint8), cv2.DIST_L2, 5)
    outside = cv2.distanceTransform((~mask).astype(np.uint8), cv2.DIST_L2, 5)
    return np.asarray(inside - outside + field > 0)


def _probed(path: Path, masks: Path, *, exhaustive: bool) -> dict[str, Any]:
    command = [sys.executable, "-m", "tests.oracles.shape.scale", str(path), str(masks)]
    if exhaustive:
        command.append("exhaustive")
    done = subprocess.run(command, check=True, capture_output=True, text=True, cwd=CHECKOUT)
    figures: dict[str, Any] = json.loads(done.stdout)
    return figures


def probe(path: Path, masks: Sequence[NDArray[np.bool_]], *, exhaustive: bool) -> dict[str, Any]:
    """Figures of one database; see `evaluate_scale`."""
    shapes = [shape_of(s) for m in masks if (s := normalise(m)) is not None]
    begin = time.perf_counter()
    database = ModelDatabase.open(path)
    opened = time.perf_counter() - begin
    database.query(shapes[0], top=_WANTED)
    first = time.perf_counter() - begin - opened
    figures = {
        "open_ms": 1e3 * opened,
        "first_ms": 1e3 * first,
        **_query_figures(database, masks),
        # Kilobytes on Linux; taken before exhaustive search, which looks at everything.
        "rss_mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
    }
    return figures | ({"lost": _lost(database, shapes)} if exhaustive else {})


def _query_figures(database: ModelDatabase, masks: Sequence[NDArray[np.bool_]]) -> dict[str, float]:
    """Times from mask to ranked list, and the share of views that was compared."""
    whole, search, spent, compared = [], [], [], []
    for mask in masks:
        begin, busy = time.perf_counter(), time.process_time()
        silhouette = normalise(mask)
        shape = None if silhouette is None else shape_of(silhouette)
        seen = time.perf_counter()
        if shape is None:
            continue
        compared.append(database.query(shape, top=_WANTED).compared / len(database.views))
        whole.append(time.perf_counter() - begin)
        search.append(time.perf_counter() - seen)
        spent.append(time.process_time() - busy)
    return {
        "ms_query": 1e3 * float(np.median(whole)),
        "ms_search": 1e3 * float(np.median(search)),
        "ms_cpu": 1e3 * float(np.median(spent)),
        "ms_worst": 1e3 * max(whole),
        "compared": float(np.mean(compared)),
    }


def _lost(database: ModelDatabase, shapes: Sequence[Shape]) -> float:
    """Share of exhaustive search's best matches that the index loses; among many views, of a sample."""
    some = shapes[:: max(1, round(len(shapes) * len(database.views) / _EXHAUSTIVE))]
    return float(
        np.mean(
            [
                database.query(s, top=1).matches[0].view.id
                != database.query(s, top=1, budget=1.0).matches[0].view.id
                for s in some
            ]
        )
    )


def main() -> None:
    """Print the figures of the database and masks named in the arguments, as JSON."""
    with np.load(sys.argv[2]) as file:
        masks = [file[name] for name in file.files]
    print(json.dumps(probe(Path(sys.argv[1]), masks, exhaustive="exhaustive" in sys.argv)))


if __name__ == "__main__":
    main()

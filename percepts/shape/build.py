"""Building a model database: views of meshes, exemplars of silhouettes, masks of a video.

Models are called as their mesh files. Nothing here depends on the order in which processes finish.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from types import MappingProxyType

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.agent.errors import DatabaseError, SettingsError
from visup.percepts.shape.cluster import medoids, similarity_matrix
from visup.percepts.shape.compare import shape_of
from visup.percepts.shape.database import ModelDatabase
from visup.percepts.shape.records import NewView
from visup.percepts.shape.silhouette import binary_picture, looks_cut, normalise
from visup.percepts.shape.views import load_mesh, render_views, sphere_directions

VIEWS = 32
"""Views rendered of each mesh unless asked otherwise."""

CLUSTERS = 8
"""Exemplars kept of a folder of silhouettes unless asked otherwise."""

PICTURES = (".png", ".bmp", ".jpg", ".jpeg", ".pgm", ".tif", ".tiff", ".webp")
"""Endings of the picture files that are read as silhouettes."""

Progress = Callable[[int, int, str], None]
"""Called with how many models are done, of how many, and the name of the last."""


def read_silhouette(path: Path) -> NDArray[np.bool_]:
    """A silhouette picture as a mask (H, W) bool, whichever of object and background is brighter.

    Raises:
        DatabaseError: The file is missing or no picture.
    """
    image = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE) if path.is_file() else None
    if image is None:
        raise DatabaseError(
            "this is not a picture that can be read"
            if path.exists()
            else "there is no such picture",
            where=str(path),
            expected="a silhouette, one shade on another, in a PNG or similar",
        )
    return binary_picture(np.asarray(image, dtype=np.uint8))


def read_silhouettes(folder: Path) -> list[NDArray[np.bool_]]:
    """All silhouette pictures in a folder as masks (H, W) bool, by file name.

    Raises:
        DatabaseError: The folder is missing, holds no pictures, or a picture cannot be read.
    """
    files = sorted(p for p in folder.glob("*") if p.suffix.lower() in PICTURES)
    if not files:
        raise DatabaseError(
            "there are no silhouette pictures here"
            if folder.is_dir()
            else "there is no such folder",
            where=str(folder),
            expected=f"a folder of pictures ({', '.join(PICTURES)})",
        )
    return [read_silhouette(f) for f in files]


def mesh_views(mesh: Path, count: int = VIEWS, seed: int = 0) -> list[NewView]:
    """Views of a mesh file, ready to be stored under the name of the file.

    Raises:
        DatabaseError: The file is no mesh.
        ExtraMissingError: What renders meshes is not installed.
    """
    views = []
    for seen in render_views(load_mesh(mesh), sphere_directions(count, seed)):
        silhouette = normalise(seen.mask)
        if silhouette is not None:
            x, y, z = (float(c) for c in seen.direction)
            views.append(NewView(mesh.stem, (x, y, z), seen.area, shape_of(silhouette)))
    return views


def silhouette_views(
    name: str, masks: Sequence[NDArray[np.bool_]], clusters: int = CLUSTERS
) -> list[NewView]:
    """Exemplars of silhouettes, ready to be stored.

    Raises:
        DatabaseError: No mask shows anything.
    """
    found = [normalise(m, cut=looks_cut(m)) for m in masks]
    shapes = [shape_of(s) for s in found if s is not None]
    if not shapes:
        raise DatabaseError(
            f"none of {len(masks)} silhouettes for {name!r} shows anything",
            expected="pictures with an object of at least 24 pixels",
        )
    chosen = medoids(similarity_matrix(shapes), clusters)
    return [NewView(name, None, None, shapes[k]) for k in chosen]


def build_database(
    path: Path | str,
    meshes: Sequence[Path],
    silhouettes: Mapping[str, Sequence[NDArray[np.bool_]]] = MappingProxyType({}),
    *,
    views: int = VIEWS,
    seed: int = 0,
    clusters: int = CLUSTERS,
    jobs: int = 1,
    progress: Progress | None = None,
) -> ModelDatabase:
    """Build a database from mesh files; each model's name is its file's stem.

    Args:
        path: Where the database is written; what stands there is replaced when all is done.
        meshes: Mesh files with different stems.
        silhouettes: Name -> masks (H, W) bool, whole pictures; their exemplars are added to that name.
        views: Views of each mesh.
        seed: Turns the directions of the views; 0 leaves them.
        clusters: Exemplars of each name's silhouettes.
        jobs: Processes.
        progress: Told of each model done.

    Returns:
        The database; the same bytes for the same input, whatever `jobs` is.

    Raises:
        SettingsError: Two meshes have the same stem, or a number is out of range.
        DatabaseError: A mesh cannot be read, or the file cannot be written.
        ExtraMissingError: What renders meshes is not installed.
    """
    _check_names(meshes)
    if not 1 <= views <= 10_000:
        raise SettingsError(f"{views} views of each mesh were asked for", expected="1 to 10000")
    done: list[NewView] = []
    for count, (mesh, new) in enumerate(
        zip(meshes, _render_all(meshes, views, seed, jobs), strict=True)
    ):
        done.extend(new)
        if progress is not None:
            progress(count + 1, len(meshes), mesh.stem)
    for name, masks in silhouettes.items():
        done.extend(silhouette_views(name, masks, clusters))
    return ModelDatabase.create(path, done)


def _check_names(meshes: Sequence[Path]) -> None:
    stems = [m.stem for m in meshes]
    twice = sorted({s for s in stems if stems.count(s) > 1})
    if twice:
        raise SettingsError(
            f"several meshes would be named {twice[0]!r}",
            expected="mesh files with different stems",
            hint="rename one of them: a model is called as its file",
        )


def _render_all(
    meshes: Sequence[Path], views: int, seed: int, jobs: int
) -> Iterable[list[NewView]]:
    if jobs <= 1 or len(meshes) <= 1:
        for mesh in meshes:
            yield mesh_views(mesh, views, seed)
        return
    with ProcessPoolExecutor(jobs, mp_context=get_context("spawn")) as pool:
        count = len(meshes)
        yield from pool.map(mesh_views, meshes, [views] * count, [seed] * count)

"""Building a model database: views of meshes, exemplars of silhouettes, masks of a video.

Models are named after their mesh files. The result does not depend on the order in which processes finish.
"""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path
from types import MappingProxyType
from typing import TypedDict, Unpack

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.agent.model.errors import DatabaseError, SettingsError
from visup.agent.storage.text_file import read_bounded
from visup.percepts.image_size import check_image_size
from visup.percepts.shape.building.build_parts import BuildPart, is_made, parts_of, read_part
from visup.percepts.shape.building.closed_views import without_gaps
from visup.percepts.shape.building.mesh_views import (
    RenderedView,
    half_sphere_directions,
    load_mesh,
    render_views,
)
from visup.percepts.shape.database.model_database import ModelDatabase
from visup.percepts.shape.database.view_directions import merge_symmetric
from visup.percepts.shape.index.view_records import NewView
from visup.percepts.shape.matching.exemplars import medoids, similarity_matrix
from visup.percepts.shape.matching.shape_similarity import shape_of
from visup.percepts.shape.refinement.mesh_model import MeshModel, mesh_model
from visup.percepts.shape.silhouette.silhouette import binary_image, looks_cut, normalise

VIEWS = 32
"""Default number of views rendered of each mesh."""

CLUSTERS = 8
"""Default number of exemplars of a folder of silhouettes."""

MAX_CLUSTERED = 400
"""Most silhouettes to cluster; more are sampled evenly."""

IMAGE_SUFFIXES = (".png", ".bmp", ".jpg", ".jpeg", ".pgm", ".tif", ".tiff", ".webp")
"""Suffixes of image files read as silhouettes."""

LARGEST_IMAGE_BYTES = 2**28
UNSCORED = 128
"""Value of mask pixels that are not scored."""

Progress = Callable[[int, int, str], None]
"""Called with the number of finished views, their total, and the name of the current model."""


def read_silhouette(path: Path) -> NDArray[np.bool_]:
    """A silhouette image as a mask (H, W) bool, whichever of object and background is brighter.

    Raises:
        DatabaseError: The file is missing or no image.
    """
    return binary_image(_read_grey(path))


def _read_grey(path: Path) -> NDArray[np.uint8]:
    try:
        data = read_bounded(path, LARGEST_IMAGE_BYTES)
        check_image_size(data)
        image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_GRAYSCALE) if data else None
    except ValueError as e:
        raise DatabaseError(f"this picture {e}", where=str(path)) from e
    except (OSError, cv2.error):
        image = None
    if image is None:
        raise DatabaseError(
            "this is not a picture that can be read"
            if path.exists()
            else "there is no such picture",
            where=str(path),
            expected="a silhouette, one shade on another, in a PNG or similar",
        )
    return np.asarray(image, dtype=np.uint8)


def read_silhouettes(folder: Path) -> list[NDArray[np.bool_]]:
    """All silhouette images in a folder as masks (H, W) bool, by file name.

    Raises:
        DatabaseError: The folder is missing, holds no images, or an image cannot be read.
    """
    return [read_silhouette(f) for f in _images_in(folder)]


def read_masks(folder: Path, label: int | None = None) -> list[NDArray[np.bool_]]:
    """An object's masks in the frames of a video, (H, W) bool each, by file name.

    Args:
        folder: Label images: 0 is background, 128 is not scored, every other value is one object.
        label: Value of the object; all objects as one when None.

    Returns:
        A mask for each frame in which the object is visible.

    Raises:
        DatabaseError: The folder is missing, holds no images, an image cannot be read, or no frame
            shows the object.
    """
    frames = (_read_grey(f) for f in _images_in(folder))
    masks = [(f == label) if label is not None else (f != 0) & (f != UNSCORED) for f in frames]
    seen = [np.asarray(m) for m in masks if m.any()]
    if not seen:
        raise DatabaseError(
            f"none of {len(masks)} masks shows {'anything' if label is None else f'label {label}'}",
            where=str(folder),
            expected="label pictures: 0 is background, other values are objects",
        )
    return seen


def _images_in(folder: Path) -> list[Path]:
    files = sorted(p for p in folder.glob("*") if p.suffix.lower() in IMAGE_SUFFIXES)
    if not files:
        raise DatabaseError(
            "there are no silhouette pictures here"
            if folder.is_dir()
            else "there is no such folder",
            where=str(folder),
            expected=f"a folder of pictures ({', '.join(IMAGE_SUFFIXES)})",
        )
    return files


def mesh_views(mesh: Path, count: int = VIEWS, seed: int = 0) -> list[NewView]:
    """Views of a mesh file, named after the file, with symmetric ones merged.

    Raises:
        DatabaseError: The file is not a mesh.
        ExtraMissingError: The renderer is not installed.
    """
    return merge_symmetric(mesh_file_views(mesh, half_sphere_directions(count, seed)))


def mesh_file_views(mesh: Path, directions: NDArray[np.float64]) -> list[NewView]:
    """Views of a mesh file from these directions (V, 3), as `mesh_views` but without merging.

    A view with narrow gaps is followed by the same view without them.
    """
    views: list[NewView] = []
    for rendered in render_views(load_mesh(mesh), directions):
        closed = without_gaps(rendered.mask)
        views += _view_of(mesh.stem, rendered)
        if closed is not None:
            views += _view_of(mesh.stem, replace(rendered, mask=closed))
    return views


def _view_of(name: str, rendered: RenderedView) -> Iterator[NewView]:
    silhouette = normalise(rendered.mask)
    if silhouette is not None:
        x, y, z = (float(c) for c in rendered.direction)
        yield NewView(name, (x, y, z), rendered.area, shape_of(silhouette))


def silhouette_views(
    name: str, masks: Sequence[NDArray[np.bool_]], clusters: int = CLUSTERS
) -> list[NewView]:
    """Exemplars of silhouettes, ready to be stored.

    Whole silhouettes and those cut by a border are clustered separately.

    Args:
        name: Name of the model.
        masks: (H, W) bool each, whole images.
        clusters: How many exemplars, shared between whole and cut ones by their numbers.

    Raises:
        DatabaseError: No mask shows anything.
    """
    silhouettes = [normalise(m, cut=looks_cut(m)) for m in masks]
    shapes = [shape_of(s) for s in silhouettes if s is not None]
    if not shapes:
        raise DatabaseError(
            f"none of {len(masks)} silhouettes for {name!r} shows anything",
            expected="pictures with an object of at least 24 pixels",
        )
    # All pairs are compared, so a long video is subsampled evenly.
    indices = np.linspace(0, len(shapes) - 1, min(len(shapes), MAX_CLUSTERED)).round().astype(int)
    sample = [shapes[k] for k in indices]
    cut = [s for s in sample if s.cut]
    cut_count = round(clusters * len(cut) / len(sample))
    if 0 < len(cut) < len(sample) and clusters > 1:
        cut_count = min(max(1, cut_count), clusters - 1)
    groups = (([s for s in sample if not s.cut], clusters - cut_count), (cut, cut_count))
    return [
        NewView(name, None, None, group[k])
        for group, count in groups
        if count
        for k in medoids(similarity_matrix(group), count)
    ]


class BuildOptions(TypedDict, total=False):
    """Options of a build.

    Attributes:
        views: Views of each mesh, before symmetric ones are merged; default `VIEWS`.
        seed: Seed of a random rotation of the view directions; 0, the default, for none.
        clusters: Exemplars of each name's silhouettes; default `CLUSTERS`.
        jobs: Number of processes; default 1.
    """

    views: int
    seed: int
    clusters: int
    jobs: int


def build_database(
    path: Path | str,
    meshes: Sequence[Path],
    silhouettes: Mapping[str, Sequence[NDArray[np.bool_]]] = MappingProxyType({}),
    *,
    progress: Progress | None = None,
    **options: Unpack[BuildOptions],
) -> ModelDatabase:
    """Build a database from mesh files; each model's name is its file's stem.

    Finished parts are stored in a folder beside the target until the build is complete: a build that was
    killed, or that stopped at a bad mesh, resumes when started again.

    Args:
        path: Where the database is written; an existing file is replaced at the end.
        meshes: Mesh files with different stems.
        silhouettes: Name -> masks (H, W) bool, whole images; their exemplars are added to that name.
        progress: Callback for finished views.
        options: See `BuildOptions`.

    Returns:
        The database; the same bytes for the same input, whatever `jobs` is and however often the
        build was resumed.

    Raises:
        SettingsError: Two meshes have the same stem, or a number is out of range.
        DatabaseError: A mesh cannot be read, or the file cannot be written.
        ExtraMissingError: The renderer is not installed.
    """
    views, jobs = options.get("views", VIEWS), options.get("jobs", 1)
    _check_names(meshes)
    if not 1 <= views <= 10_000:
        raise SettingsError(f"{views} views of each mesh were asked for", expected="1 to 10000")
    target = Path(path)
    folder = building_folder(target)
    parts_by_mesh = [parts_of(mesh, folder, views, options.get("seed", 0)) for mesh in meshes]
    _make_parts([p for parts in parts_by_mesh for p in parts], jobs, progress)

    def all_views() -> Iterator[NewView]:
        for parts in parts_by_mesh:
            yield from merge_symmetric([v for part in parts for v in read_part(part)])
        for name, masks in silhouettes.items():
            yield from silhouette_views(name, masks, options.get("clusters", CLUSTERS))

    mesh_models = (_read_mesh_model(mesh) for mesh in meshes)
    built = ModelDatabase.create(target, all_views(), mesh_models)
    shutil.rmtree(folder, ignore_errors=True)
    return built


def _read_mesh_model(path: Path) -> MeshModel:
    """The mesh model of a file, stored beside its views."""
    mesh = load_mesh(path)
    return mesh_model(path.stem, mesh.vertices, mesh.faces)


def building_folder(target: Path) -> Path:
    """The folder of finished parts of a build."""
    return target.parent / f".{target.name}.building"


def _check_names(meshes: Sequence[Path]) -> None:
    stems = [m.stem for m in meshes]
    duplicates = sorted({s for s in stems if stems.count(s) > 1})
    if duplicates:
        raise SettingsError(
            f"several meshes would be named {duplicates[0]!r}",
            expected="mesh files with different stems",
            hint="rename one of them: a model is named after its file",
        )


def _make_parts(parts: Sequence[BuildPart], jobs: int, progress: Progress | None) -> None:
    """Make all missing parts."""
    done, total = 0, sum(p.count for p in parts)

    def report_progress(part: BuildPart) -> None:
        nonlocal done
        done += part.count
        if progress is not None:
            progress(done, total, part.mesh.stem)

    missing = []
    for part in parts:
        if is_made(part):
            report_progress(part)
        else:
            missing.append(part)
    if jobs <= 1 or len(missing) <= 1:
        for part in missing:
            make_part(part)
            report_progress(part)
        return
    with ProcessPoolExecutor(min(jobs, len(missing)), mp_context=get_context("spawn")) as pool:
        futures = {pool.submit(make_part, part): part for part in missing}
        try:
            for finished in as_completed(futures):
                finished.result()
                report_progress(futures[finished])
        except BaseException:
            pool.shutdown(wait=True, cancel_futures=True)
            raise


def make_part(part: BuildPart) -> None:
    """Render a part's views into its file.

    Raises:
        DatabaseError: The mesh cannot be read, or the file cannot be written.
        ExtraMissingError: The renderer is not installed.
    """
    directions = half_sphere_directions(part.views, part.seed)[part.first : part.first + part.count]
    new = mesh_file_views(part.mesh, directions)
    try:
        part.path.parent.mkdir(exist_ok=True)
    except OSError as e:
        raise DatabaseError(
            f"the database cannot be written ({e.strerror})",
            where=str(part.path.parent.parent),
            expected="a folder that exists and can be written to",
        ) from e
    ModelDatabase.create(part.path, new)

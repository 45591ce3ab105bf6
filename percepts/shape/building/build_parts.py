"""Parts of a build: some views of one mesh, stored in a file until all parts are done.

A part's file is a model database. Its name hashes the mesh's content and all settings that the views depend
on, so that only a build with exactly the same input reuses it.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from visup.agent.model.errors import DatabaseError, VisupError
from visup.agent.storage.text_file import read_bounded
from visup.percepts.shape.database.catalogue import Shapes, Views
from visup.percepts.shape.database.file_format import VERSION
from visup.percepts.shape.index.view_records import LAYOUT, NewView
from visup.percepts.shape.silhouette.silhouette import SMOOTHING
from visup.version import __version__

VIEWS_OF_A_PART = 64
"""Views of a part at most: one mesh with many views keeps all processes busy."""

LARGEST_MESH_BYTES = 2**28


@dataclass(frozen=True, slots=True)
class BuildPart:
    """Some views of one mesh.

    Attributes:
        mesh: Its file.
        views: Total number of views of the mesh.
        seed: Seed of their directions.
        first: Number of the first view of this part.
        count: Number of views of this part.
        path: File of the part.
    """

    mesh: Path
    views: int
    seed: int
    first: int
    count: int
    path: Path


def parts_of(mesh: Path, folder: Path, views: int, seed: int) -> list[BuildPart]:
    """The parts of one mesh's views.

    Raises:
        DatabaseError: The mesh cannot be read.
    """
    try:
        content = read_bounded(mesh, LARGEST_MESH_BYTES)
    except OSError as e:
        raise DatabaseError(
            f"cannot be read ({e.strerror})" if mesh.exists() else "there is no such mesh file",
            where=str(mesh),
            expected="a mesh file",
        ) from e
    settings = (__version__, VERSION, LAYOUT, SMOOTHING, mesh.name, views, seed)
    key = hashlib.sha256(content + repr(settings).encode()).hexdigest()[:32]
    return [
        BuildPart(
            mesh=mesh,
            views=views,
            seed=seed,
            first=first,
            count=min(VIEWS_OF_A_PART, views - first),
            path=folder / f"{key}-{first}",
        )
        for first in range(0, views, VIEWS_OF_A_PART)
    ]


def is_made(part: BuildPart) -> bool:
    """Whether a part's file exists, complete and valid."""
    try:
        return part.path.is_file() and all(True for _ in read_part(part))
    except VisupError:
        return False


def read_part(part: BuildPart) -> Iterator[NewView]:
    """The views of a finished part.

    Raises:
        DatabaseError: Its file is damaged.
    """
    views = Views.read(part.path)
    for view, shape in zip(views, Shapes(part.path, views), strict=True):
        yield NewView(part.mesh.stem, view.direction, view.area, shape, view.also, view.smoothing)

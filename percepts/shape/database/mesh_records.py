"""Meshes for pose fitting as rows of a database file, with check sums."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterable
from pathlib import Path

from visup.agent.model.errors import DatabaseError
from visup.percepts.shape.database.file_format import MeshRow, damaged
from visup.percepts.shape.index.view_records import InvalidRecordError
from visup.percepts.shape.refinement.mesh_model import MeshModel, mesh_bytes, stored_mesh


def encoded_mesh(model: MeshModel) -> MeshRow:
    """The row of a mesh."""
    return MeshRow(model.name, model.radius, *mesh_bytes(model))


def decoded_mesh(path: Path, row: MeshRow) -> MeshModel:
    """The mesh of a row.

    Raises:
        DatabaseError: The row holds no valid mesh.
    """
    try:
        return stored_mesh(row.name, row.radius, row.vertices, row.faces)
    except DatabaseError as e:
        raise damaged(path, f"the mesh of '{row.name}'", "what was written") from e


def read_meshes(file: sqlite3.Connection) -> tuple[MeshRow, ...]:
    """All mesh rows of a file, with verified check sums.

    Raises:
        InvalidRecordError: A row is damaged.
    """
    rows: list[MeshRow] = []
    query = "SELECT number, name, radius, vertices, faces, crc FROM meshes ORDER BY number"
    for expected, (number, name, radius, vertices, faces, crc) in enumerate(file.execute(query)):
        valid = isinstance(vertices, bytes) and isinstance(faces, bytes)
        valid &= isinstance(name, str) and isinstance(radius, float)
        row = MeshRow(name, radius, vertices, faces)
        if number != expected or not valid or crc != row.checksum(number):
            raise InvalidRecordError(f"a wrong check sum of mesh {expected + 1}")
        rows.append(row)
    if len({row.name for row in rows}) < len(rows):
        raise InvalidRecordError("two meshes of one name")
    return tuple(rows)


def insert_meshes(file: sqlite3.Connection, rows: Iterable[MeshRow]) -> None:
    """Write the meshes of a new file."""
    with file:
        for number, row in enumerate(rows):
            file.execute(
                "INSERT INTO meshes VALUES (?, ?, ?, ?, ?, ?)",
                (number, row.name, row.radius, row.vertices, row.faces, row.checksum(number)),
            )

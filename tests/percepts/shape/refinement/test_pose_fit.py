"""A pose is found again from the picture that it gives, mirrored views told apart."""

import sqlite3
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from visup.agent.model.errors import DatabaseError
from visup.percepts.shape.database.model_database import ModelDatabase
from visup.percepts.shape.refinement._pose_fit_jit import fit_of, start_place
from visup.percepts.shape.refinement.mesh_model import (
    MAX_FACES,
    MeshModel,
    mesh_bytes,
    mesh_model,
    stored_mesh,
)
from visup.percepts.shape.refinement.pose_fit import fitted_poses
from visup.percepts.shape.refinement.region_image import SIDE, RegionImage
from visup.render.meshes.spacecraft import spartan

FAR = 8.0


def satellite_mesh() -> MeshModel:
    mesh = spartan()
    return mesh_model("satellite", mesh.vertices, mesh.faces)


def rendered_image(model: MeshModel, orientation: NDArray[np.float64]) -> RegionImage:
    """What a camera sees, lit from the upper left; drawn with the same loops."""
    side = (np.empty((len(model.vertices), 3)), np.empty((SIDE, SIDE)))
    number = np.empty((SIDE, SIDE), np.int32)
    blank = np.zeros((SIDE, SIDE))
    disc = blank.copy()
    disc[14:38, 14:38] = 1.0
    mesh, place = (model.vertices, model.faces, model.normals), start_place(disc)
    for _ in range(3):
        fit_of(mesh, (disc, blank), orientation, FAR, place, (*side, number))
    normals = model.normals[np.maximum(number, 0)] @ orientation.T
    normals *= np.where(normals[..., 2:] > 0, -1.0, 1.0)
    light = np.clip(normals @ np.array([-0.5, -0.6, -0.6]), 0, None)
    tone = np.where(number >= 0, 40 + 180 * light, 0.0)
    return RegionImage((number >= 0).astype(np.float64), tone, 1.0)


def apart_deg(a: NDArray[np.float64], b: NDArray[np.float64]) -> float:
    return float(np.degrees(Rotation.from_matrix(a @ b.T).magnitude()))


def nearby(true: NDArray[np.float64], away: float, seed: int) -> NDArray[np.float64]:
    axis = np.random.default_rng(seed).normal(size=3)
    turn = Rotation.from_rotvec(axis / np.linalg.norm(axis) * away).as_matrix()
    return np.asarray(turn @ true)


def test_poses_are_recovered_from_nearby_starts() -> None:
    model, errors = satellite_mesh(), []
    for seed in range(24):
        true = Rotation.random(random_state=seed).as_matrix()
        picture = rendered_image(model, true)
        (best, *_) = fitted_poses(
            model, picture, [nearby(true, 0.25, seed)], focal_px=FAR * SIDE / 4
        )
        errors.append(apart_deg(best.orientation, true))
    assert np.median(errors) < 3.0
    assert np.mean(np.array(errors) < 8.0) >= 0.8


@settings(max_examples=10, deadline=None)
@given(st.integers(0, 10_000), st.floats(0.0, 3.0))
def test_a_search_never_ends_worse_than_it_began(seed: int, away: float) -> None:
    model, true = satellite_mesh(), Rotation.random(random_state=seed).as_matrix()
    picture, start = rendered_image(model, true), nearby(true, away, seed)
    focal = FAR * SIDE / 4
    still = fitted_poses(model, picture, [start], steps=np.zeros(0), focal_px=focal)[0]
    best = fitted_poses(model, picture, [start], focal_px=focal)[0]
    assert best.score >= still.score
    assert np.allclose(best.orientation @ best.orientation.T, np.eye(3), atol=1e-9)


def test_shading_distinguishes_a_view_from_its_mirror_image() -> None:
    """Seen from behind and mirrored, a satellite with a plane of symmetry has the same outline."""
    model, right = satellite_mesh(), 0
    for seed in range(8):
        true = Rotation.random(random_state=seed).as_matrix()
        picture = rendered_image(model, true)
        # Reflected in the image plane and in the object's own plane of symmetry.
        behind = np.diag([1.0, 1.0, -1.0]) @ true @ np.diag([1.0, -1.0, 1.0])
        best = fitted_poses(model, picture, [behind, true], focal_px=FAR * SIDE / 4)[0]
        right += apart_deg(best.orientation, true) < 10.0
    assert right >= 7


def test_a_large_mesh_is_simplified_and_keeps_its_size() -> None:
    rng = np.random.default_rng(1)
    points = rng.normal(size=(9000, 3))
    points /= np.linalg.norm(points, axis=1)[:, None]
    model = mesh_model("ball", 3.0 * points, np.arange(9000).reshape(-1, 3))
    assert len(model.faces) <= 3000
    assert model.radius == pytest.approx(3.0, rel=0.05)
    assert abs(np.linalg.norm(model.vertices, axis=1) - 1.0).max() < 0.08
    assert MAX_FACES < 3000


def test_stored_meshes_round_trip() -> None:
    model = satellite_mesh()
    again = stored_mesh("satellite", model.radius, *mesh_bytes(model))
    assert np.array_equal(again.vertices, model.vertices)
    assert np.array_equal(again.faces, model.faces)


@pytest.mark.parametrize(
    ("vertices", "faces"),
    [
        (b"", b""),
        (b"\0" * 13, b"\0" * 12),
        (b"\0" * 12, b"\1\0\0\0" * 3),
        (b"\0\0\xc0\x7f" * 3, b"\0" * 12),
    ],
)
def test_a_damaged_mesh_is_refused(vertices: bytes, faces: bytes) -> None:
    with pytest.raises(DatabaseError):
        stored_mesh("x", 1.0, vertices, faces)


def test_a_database_stores_the_meshes_of_its_models(tmp_path: Path) -> None:
    model = satellite_mesh()
    database = ModelDatabase.create(tmp_path / "db", [], [model])
    kept = ModelDatabase.open(database.path).meshes["satellite"]
    assert np.array_equal(kept.vertices, model.vertices)
    assert kept.radius == model.radius
    with closing(sqlite3.connect(database.path)) as file, file:
        file.execute("UPDATE meshes SET radius = radius + 1")
    with pytest.raises(DatabaseError, match="check sum of mesh 1"):
        ModelDatabase.open(database.path)

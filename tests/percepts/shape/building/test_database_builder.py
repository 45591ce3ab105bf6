"""Building a model database: meshes, silhouettes, symmetric views, neighbours, stopped builds."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.percepts.shape.shapes import ZOO, flower, small_database
from visup.agent.model.errors import DatabaseError, SettingsError
from visup.percepts.shape.building import build_parts, database_builder
from visup.percepts.shape.building.build_parts import parts_of
from visup.percepts.shape.building.database_builder import (
    build_database,
    building_folder,
    mesh_views,
    read_silhouettes,
    silhouette_views,
)
from visup.percepts.shape.building.mesh_views import (
    half_sphere_directions,
    load_mesh,
    render_views,
    sphere_directions,
)
from visup.percepts.shape.database.model_database import ModelDatabase
from visup.percepts.shape.database.view_directions import (
    frequencies,
    merge_symmetric,
    neighbours,
    outline_gap,
)
from visup.percepts.shape.index.view_records import NewView
from visup.percepts.shape.silhouette.silhouette import normalise

trimesh = pytest.importorskip("trimesh", reason="views of meshes need the extra 'render'")


@pytest.fixture(scope="module")
def stored(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return small_database(tmp_path_factory.mktemp("db") / "zoo.db").path


def box(path: Path, size: tuple[float, float, float] = (1.0, 2.0, 3.0)) -> Path:
    trimesh.creation.box(extents=size).export(path)
    return path


def test_silhouettes_of_a_known_model_are_added_to_it(stored: Path, tmp_path: Path) -> None:
    path = tmp_path / "more.db"
    shutil.copyfile(stored, path)
    masks = [flower(((4, d),)) for d in (0.1, 0.12, 0.3, 0.32)]
    database = ModelDatabase.open(path).add(silhouette_views("star", masks, 2))
    own = [v for v in database.views if v.name == "star"]
    assert [v.number for v in own] == [0, 1, 2]
    assert [v.area for v in own] == [1.0, None, None]


def test_views_of_a_box_have_its_area(tmp_path: Path) -> None:
    for view in mesh_views(box(tmp_path / "box.ply"), 12):
        assert view.direction is not None
        # The area of a box's parallel projection is the sum of its faces' projections.
        expected = np.abs(view.direction) @ np.array([2 * 3, 1 * 3, 1 * 2])
        assert view.area == pytest.approx(expected, rel=0.01)


def test_a_build_gives_the_same_bytes_with_one_process_or_two(tmp_path: Path) -> None:
    meshes = [box(tmp_path / "a.ply"), box(tmp_path / "b.ply", (1, 1, 4))]
    told: list[tuple[int, int, str]] = []
    one = build_database(tmp_path / "1.db", meshes, views=3, progress=lambda *t: told.append(t))
    two = build_database(tmp_path / "2.db", meshes, views=3, jobs=2)
    assert one.path.read_bytes() == two.path.read_bytes()
    assert told == [(3, 6, "a"), (6, 6, "b")]
    assert [(v.name, v.number) for v in two.views] == [(n, k) for n in "ab" for k in range(3)]


def test_a_killed_build_resumes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(build_parts, "VIEWS_OF_A_PART", 3)
    meshes = [box(tmp_path / "a.ply"), box(tmp_path / "b.ply", (1, 1, 4))]
    whole = build_database(tmp_path / "whole.db", meshes, views=5)
    target = tmp_path / "killed.db"
    rendered: list[str] = []
    once = database_builder.mesh_file_views

    def dies(mesh: Path, directions: np.ndarray) -> list[NewView]:
        rendered.append(f"{mesh.stem} {len(directions)}")
        if len(rendered) == 3:
            raise KeyboardInterrupt
        return once(mesh, directions)

    monkeypatch.setattr(database_builder, "mesh_file_views", dies)
    with pytest.raises(KeyboardInterrupt):
        build_database(target, meshes, views=5)
    assert not target.exists()
    kept = building_folder(target)
    assert len(list(kept.glob("[!.]*"))) == 2
    # One of the two that are done is damaged: it alone is made again, with what is missing.
    min(kept.glob("[!.]*")).write_bytes(b"cut short")
    again = build_database(target, meshes, views=5)
    assert len(rendered) == 3 + 3
    assert again.path.read_bytes() == whole.path.read_bytes()
    assert not kept.exists()


def test_parts_with_other_settings_or_meshes_are_not_reused(tmp_path: Path) -> None:
    mesh = box(tmp_path / "a.ply")
    first = {p.path for p in parts_of(mesh, tmp_path, 4, 0)}
    others = [parts_of(mesh, tmp_path, 5, 0), parts_of(mesh, tmp_path, 4, 1)]
    others.append(parts_of(box(mesh, (1, 2, 2)), tmp_path, 4, 0))
    assert all(first.isdisjoint(p.path for p in parts) for parts in others)


def test_views_around_a_body_of_revolution_are_merged(tmp_path: Path) -> None:
    trimesh.creation.icosphere(4).export(tmp_path / "ball.ply")
    (view,) = mesh_views(tmp_path / "ball.ply", 6)
    assert len(view.also) == 5
    database = ModelDatabase.create(tmp_path / "ball.db", [view])
    (stored,) = database.views
    assert stored.also == view.also
    assert stored.seen_from == (view.direction, *view.also)
    assert database.neighbours(stored) == ()


def test_symmetric_views_are_merged_with_the_direction_that_shows_them(tmp_path: Path) -> None:
    mesh = load_mesh(box(tmp_path / "box.ply"))
    toward = np.array([0.48, 0.6, 0.64])
    # Across a plane of symmetry the silhouette is mirrored: unmirrored it is seen from the opposite.
    across = toward * (-1, 1, 1)
    other = np.array([0.8, -0.36, 0.48])
    views = merge_symmetric(
        database_builder.mesh_file_views(tmp_path / "box.ply", np.stack([toward, across, other]))
    )
    assert [v.direction for v in views] == [tuple(toward), tuple(other)]
    assert views[0].also == (tuple(-across),)
    seen = render_views(mesh, np.stack([toward, -across]))
    shapes = [normalise(s.mask) for s in seen]
    assert all(s is not None for s in shapes)
    straight, mirrored = outline_gap(*(frequencies(s.contour) for s in shapes if s is not None))
    assert straight < 0.005 < mirrored


@settings(max_examples=15, deadline=None)
@given(st.integers(1, 40), st.integers(0, 5))
def test_neighbours_surround_every_view(count: int, seed: int) -> None:
    directions = half_sphere_directions(count, seed)
    assert np.linalg.norm(directions, axis=1) == pytest.approx(1.0)
    found = neighbours([[tuple(d.tolist())] for d in directions])
    near = np.abs(directions @ directions.T) - 2 * np.eye(count)
    for k, others in enumerate(found):
        assert k not in others
        assert all(k in found[o] for o in others)
        assert count == 1 or int(near[k].argmax()) in others
        assert count < 8 or len(others) >= 3


def test_neighbours_of_a_view_in_a_database(tmp_path: Path) -> None:
    meshes = [box(tmp_path / "a.ply"), box(tmp_path / "b.ply", (1, 1.3, 4))]
    database = build_database(tmp_path / "x.db", meshes, views=12)
    for view in database.views:
        others = database.neighbours(view)
        assert others
        assert all(o.name == view.name and view in database.neighbours(o) for o in others)
    flat = small_database(tmp_path / "zoo.db").add(silhouette_views("star", [ZOO["star"]], 1))
    assert flat.neighbours(flat.views[-1]) == ()


def test_views_spread_over_half_of_the_sphere() -> None:
    rng = np.random.default_rng(0)
    toward = rng.normal(size=(2000, 3))
    toward /= np.linalg.norm(toward, axis=1, keepdims=True)

    def farthest(directions: np.ndarray) -> float:
        return float(
            np.degrees(np.arccos(np.abs(toward @ directions.T).max(axis=1).clip(0, 1))).max()
        )

    assert farthest(half_sphere_directions(32)) < 18.5 < farthest(sphere_directions(32))


def test_two_meshes_of_one_name_are_refused(tmp_path: Path) -> None:
    with pytest.raises(SettingsError, match="named 'a'"):
        build_database(tmp_path / "x.db", [tmp_path / "a.ply", tmp_path / "b" / "a.ply"])


@pytest.mark.parametrize("content", [None, b"", b"not a mesh"], ids=["missing", "empty", "text"])
def test_an_invalid_mesh_is_refused(tmp_path: Path, content: bytes | None) -> None:
    mesh = tmp_path / "bad.ply"
    if content is not None:
        mesh.write_bytes(content)
    with pytest.raises(DatabaseError):
        build_database(tmp_path / "x.db", [mesh])
    assert not (tmp_path / "x.db").exists()


@pytest.mark.parametrize(
    ("places", "corners"),
    [(0, "0 1 2"), (3, "0 1 7"), (3, "0 1 -1")],
    ids=["none", "beyond", "below"],
)
def test_triangles_with_missing_vertices_are_refused(
    tmp_path: Path, places: int, corners: str
) -> None:
    """The loops that cast rays believe the numbers of vertices that they are given."""
    head = ["ply", "format ascii 1.0", f"element vertex {places}"]
    head += [f"property float {axis}" for axis in "xyz"]
    head += ["element face 1", "property list uchar int vertex_indices", "end_header"]
    rows = ["0 0 0", "1 0 0", "0 1 0"][:places]
    mesh = tmp_path / "a.ply"
    mesh.write_text("\n".join([*head, *rows, f"3 {corners}", ""]))
    with pytest.raises(DatabaseError, match="no triangles of finite size"):
        load_mesh(mesh)


def test_folders_without_images_are_refused(tmp_path: Path) -> None:
    with pytest.raises(DatabaseError, match="no silhouette pictures"):
        read_silhouettes(tmp_path)
    (tmp_path / "a.png").write_text("no picture")
    with pytest.raises(DatabaseError, match="not a picture"):
        read_silhouettes(tmp_path)
    with pytest.raises(DatabaseError, match="shows anything"):
        silhouette_views("x", [np.zeros((9, 9), bool)])


def test_the_opposite_view_is_the_mirror_image(tmp_path: Path) -> None:
    """The convention on roll that mirrored matches rely on."""
    mesh = load_mesh(box(tmp_path / "box.ply"))
    mesh.vertices[0] += (0.7, 0.4, 0.2)
    toward = np.array([0.48, 0.6, 0.64])
    front, back = render_views(mesh, np.stack([toward, -toward]))
    assert back.area == pytest.approx(front.area, rel=0.01)
    assert back.mask.shape == front.mask.shape
    assert (front.mask[:, ::-1] != back.mask).mean() < 0.01

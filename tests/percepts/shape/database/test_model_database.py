"""The model database: round trips, refusals, and what a query answers."""

from __future__ import annotations

import copy
import dataclasses
import shutil
import sqlite3
import zlib
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest

from tests.percepts.shape.shapes import ZOO, limbs, shape, small_database
from visup.agent.model.errors import DatabaseError, VisupError
from visup.percepts.shape.building.database_builder import (
    silhouette_views,
)
from visup.percepts.shape.database.file_format import APPLICATION_ID, VERSION
from visup.percepts.shape.database.model_database import ModelDatabase
from visup.percepts.shape.index.view_records import NODE, VIEW, NewView
from visup.percepts.shape.matching.shape_similarity import compare_shapes
from visup.percepts.shape.shocks.shock_graph import ShockGraph

trimesh = pytest.importorskip("trimesh", reason="views of meshes need the extra 'render'")


@pytest.fixture(scope="module")
def stored(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return small_database(tmp_path_factory.mktemp("db") / "zoo.db").path


def test_written_views_are_read_back(stored: Path) -> None:
    database = ModelDatabase.open(stored)
    assert database.names() == tuple(ZOO)
    for view, loaded, mask in zip(database.views, database.shapes, ZOO.values(), strict=True):
        fresh = shape(mask)
        assert (view.number, view.direction, view.area, view.cut) == (
            0,
            (0.0, 0.0, 1.0),
            1.0,
            False,
        )
        np.testing.assert_array_equal(loaded.graph.edges, fresh.graph.edges)
        np.testing.assert_allclose(loaded.graph.profiles, fresh.graph.profiles, atol=2e-3)
        assert compare_shapes(loaded, fresh).similarity > 0.999
        np.testing.assert_array_equal(loaded.graph.below, fresh.graph.below)
        np.testing.assert_allclose(loaded.contour, fresh.contour, atol=1e-3)


def test_a_database_is_shared_until_its_file_changes(stored: Path, tmp_path: Path) -> None:
    path = tmp_path / "zoo.models"
    shutil.copy(stored, path)
    database = ModelDatabase.shared(path)
    assert ModelDatabase.shared(path) is database
    database.add([NewView("disc", None, None, shape(np.pad(np.ones((20, 20), bool), 5)))])
    assert "disc" in ModelDatabase.shared(path).names()
    path.unlink()
    with pytest.raises(DatabaseError, match="no such model database"):
        ModelDatabase.shared(path)


def test_a_copy_finds_the_same(stored: Path) -> None:
    database = ModelDatabase.open(stored)
    query = shape(ZOO["walker"])
    assert copy.deepcopy(database).query(query) == database.query(query)


def test_equal_content_gives_equal_bytes(stored: Path, tmp_path: Path) -> None:
    assert small_database(tmp_path / "again.db").path.read_bytes() == stored.read_bytes()


@pytest.mark.parametrize("name", sorted(ZOO))
def test_a_rotated_shape_is_recognised(stored: Path, name: str) -> None:
    mask = np.rot90(ZOO[name])
    best = ModelDatabase.open(stored).query(mask, top=2).matches
    assert best[0].view.name == name
    assert best[0].similarity > 0.9 > best[1].similarity


def test_matches_are_ranked_bounded_and_above_the_threshold(stored: Path) -> None:
    database = ModelDatabase.open(stored)
    every = database.query(ZOO["star"], top=10).matches
    assert [m.similarity for m in every] == sorted((m.similarity for m in every), reverse=True)
    assert len(database.query(ZOO["star"], top=2).matches) == 2
    some = database.query(ZOO["star"], threshold=0.9).matches
    assert [m.view.name for m in some] == ["star"]


def test_a_query_equals_an_exhaustive_search(stored: Path) -> None:
    from visup.percepts.shape.matching.shape_similarity import compare_shapes

    database = ModelDatabase.open(stored)
    query = shape(limbs((0.5, 2.5, 4.1)))
    every = (compare_shapes(query, s, rigid=True).similarity for s in database.shapes)
    expected = sorted(every, reverse=True)
    found = [m.similarity for m in database.query(query, top=3).matches]
    assert found == pytest.approx(expected[:3], abs=2e-5)


def test_a_query_may_be_restricted_to_names(stored: Path) -> None:
    found = ModelDatabase.open(stored).query(ZOO["star"], restrict={"pear", "stick"}).matches
    assert {m.view.name for m in found} == {"pear", "stick"}


def test_an_empty_mask_matches_nothing(stored: Path) -> None:
    assert ModelDatabase.open(stored).query(np.zeros((20, 20), bool)).matches == ()


def test_an_empty_database_gives_no_matches(tmp_path: Path) -> None:
    assert ModelDatabase.create(tmp_path / "empty.db").query(ZOO["star"]).matches == ()


def test_a_cut_shape_is_found_among_cut_views(stored: Path, tmp_path: Path) -> None:
    path = tmp_path / "cut.db"
    shutil.copyfile(stored, path)
    half = ZOO["walker"][: ZOO["walker"].shape[0] // 2]
    database = ModelDatabase.open(path).add(silhouette_views("half walker", [half], 1))
    assert database.views[-1].cut
    best = database.query(half[:, 20:], cut=True).matches[0]
    assert (best.view.name, best.similarity > 0.9) == ("half walker", True)


def set_pragma(name: str, value: int) -> Callable[[Path], None]:
    def damage(path: Path) -> None:
        with closing(sqlite3.connect(path)) as file:
            file.execute(f"PRAGMA {name} = {value}")
            file.commit()

    return damage


def run_sql(sql: str) -> Callable[[Path], None]:
    def damage(path: Path) -> None:
        with closing(sqlite3.connect(path)) as file:
            file.execute(sql)
            file.commit()

    return damage


def truncate(path: Path) -> None:
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def check_sum(number: int, *parts: bytes) -> int:
    for part in parts:
        number = zlib.crc32(part, number)
    return number


def in_block(field: str, value: object) -> Callable[[Path], None]:
    """Every view gets another value, and the block a check sum that agrees."""

    def damage(path: Path) -> None:
        with closing(sqlite3.connect(path)) as file, file:
            for number, data, also in file.execute("SELECT number, views, also FROM blocks"):
                rows = np.frombuffer(data, VIEW).copy()
                part = rows["root"] if field in (NODE.names or ()) else rows
                part[field] = value
                row = (rows.tobytes(), check_sum(number, rows.tobytes(), also), number)
                file.execute("UPDATE blocks SET views = ?, crc = ? WHERE number = ?", row)

    return damage


def in_shape(part: str, change: Callable[[bytes], bytes]) -> Callable[[Path], None]:
    """The first view's shape gets another part, and a check sum that agrees."""

    def damage(path: Path) -> None:
        with closing(sqlite3.connect(path)) as file, file:
            columns = ("nodes", "edges", "contour")
            row = file.execute("SELECT nodes, edges, contour FROM shapes WHERE view = 0").fetchone()
            parts = dict(zip(columns, row, strict=True))
            parts[part] = change(parts[part])
            file.execute(
                "UPDATE shapes SET nodes = ?, edges = ?, contour = ?, crc = ? WHERE view = 0",
                (*parts.values(), check_sum(0, *parts.values())),
            )

    return damage


def nodes_with(field: str, value: object) -> Callable[[bytes], bytes]:
    def change(data: bytes) -> bytes:
        nodes = np.frombuffer(data, NODE).copy()
        nodes[field][1:] = value
        return nodes.tobytes()

    return change


def turn_into_folder(path: Path) -> None:
    path.unlink()
    path.mkdir()


def swap_shapes(path: Path) -> None:
    """Two sound rows change places."""
    with closing(sqlite3.connect(path)) as file, file:
        for a, b in ((0, 77), (1, 0), (77, 1)):
            file.execute(f"UPDATE shapes SET view = {b} WHERE view = {a}")


ENDLESS = (
    "DROP TABLE models; CREATE VIEW models AS WITH RECURSIVE c(code) AS "
    "(SELECT 0 UNION ALL SELECT code + 1 FROM c) SELECT code, 'x' || code AS name, 0 AS crc FROM c"
)

REFUSED: dict[str, tuple[Callable[[Path], object], str]] = {
    "missing": (lambda p: p.unlink(), "no such model database"),
    "a folder": (turn_into_folder, "no such model database"),
    "a text": (lambda p: p.write_text("this is no database at all\n" * 100), "can be read"),
    "empty": (lambda p: p.write_bytes(b""), "can be read"),
    "foreign": (set_pragma("application_id", 7), "not a model database"),
    "newer": (set_pragma("user_version", VERSION + 1), f"of version {VERSION + 1}"),
    "older": (set_pragma("user_version", 0), "of version 0"),
    "truncated": (truncate, "truncated"),
    "other layout": (run_sql("UPDATE layout SET meaning = '<f8' WHERE part = 'point'"), "layout"),
    "no shapes": (run_sql("DELETE FROM shapes"), "other views than shapes"),
    "no shape": (run_sql("DELETE FROM shapes WHERE view = 0"), "view 1 without a shape"),
    "no views": (run_sql("DELETE FROM blocks"), "a model without views"),
    "no table": (run_sql("DROP TABLE shapes"), "its tables"),
    "endless": (lambda p: [run_sql(sql)(p) for sql in ENDLESS.split("; ")], "its tables"),
    "other bytes": (run_sql("UPDATE blocks SET views = zeroblob(length(views))"), "check sum"),
    "bomb": (run_sql("UPDATE blocks SET views = zeroblob(40000000)"), "can be read"),
    "huge": (run_sql(f"UPDATE blocks SET views = zeroblob({VIEW.itemsize * 9999})"), "9999 views"),
    "short": (run_sql("UPDATE blocks SET views = x'00'"), "length"),
    "text": (run_sql("UPDATE blocks SET views = 'text'"), "length"),
    "no block": (run_sql("UPDATE blocks SET number = 7"), "block 0 is missing"),
    "other name": (run_sql("UPDATE models SET name = 'x' WHERE code = 1"), "check sum of model 1"),
    "no name": (run_sql("UPDATE models SET name = x'ff' WHERE code = 0"), "model 0 without a name"),
    "no model": (in_block("model", 99), "a view of no model"),
    "bad number": (in_block("number", 3), "not numbered"),
    "bad direction": (in_block("direction", 9e9), "not a unit vector"),
    "bad area": (in_block("area", -1.0), "an area"),
    "bad mark": (in_block("cut", 7), "mark of a cut"),
    "bad smoothing": (in_block("smoothing", np.nan), "a smoothing"),
    "bad root": (in_block("profiles", np.nan), "profiles"),
    "exchanged": (swap_shapes, "check sum of the shape"),
    "other root": (in_shape("nodes", lambda b: b[NODE.itemsize :] + b[: NODE.itemsize]), "root"),
    "bad kind": (in_shape("nodes", nodes_with("kinds", 9)), "no known kind"),
    "negative": (in_shape("nodes", nodes_with("lengths", -1.0)), "negative lengths"),
    "infinite": (in_shape("nodes", nodes_with("positions", np.inf)), "positions"),
    "many nodes": (in_shape("nodes", lambda b: b * 99), "nodes"),
    "no outline": (in_shape("contour", lambda b: b""), "0 points"),
    "no extent": (in_shape("contour", lambda b: bytes(len(b))), "an outline that is none"),
    "cycle": (in_shape("edges", lambda b: bytes(len(b))), "a graph that is none"),
    "far edge": (in_shape("edges", lambda b: b[:-2] + b"\x70\x00"), "a graph that is none"),
    "odd edges": (in_shape("edges", lambda b: b[:-1]), "length"),
}


@pytest.mark.parametrize("case", sorted(REFUSED))
def test_an_invalid_file_is_refused(stored: Path, tmp_path: Path, case: str) -> None:
    damage, message = REFUSED[case]
    path = tmp_path / "bad.db"
    shutil.copyfile(stored, path)
    damage(path)
    with pytest.raises(DatabaseError) as refused:
        _ = list(ModelDatabase.open(path).shapes)
    assert message in refused.value.what
    assert str(path) in str(refused.value)
    assert refused.value.hint


def test_views_and_shapes_behave_as_sequences(stored: Path) -> None:
    database = ModelDatabase.open(stored)
    views = list(database.views)
    assert database.views[-1] == views[-1]
    assert database.views[1:3] == tuple(views[1:3])
    assert [v.id for v in database.views] == list(range(1, len(ZOO) + 1))
    assert database.shapes[0] is database.shapes[0]
    assert database.shapes[:2] == (database.shapes[0], database.shapes[1])
    with pytest.raises(IndexError):
        _ = database.views[len(ZOO)]


def test_all_features_of_a_node_are_stored() -> None:
    derived = {"edges", "below", "key"}
    assert {f.name for f in dataclasses.fields(ShockGraph)} - derived == set(NODE.names or ())


def test_a_failed_write_leaves_the_old_file(stored: Path, tmp_path: Path) -> None:
    path = tmp_path / "kept.db"
    shutil.copyfile(stored, path)

    def breaks() -> object:
        raise DatabaseError("no more views")
        yield

    with pytest.raises(DatabaseError, match="no more views"):
        ModelDatabase.create(path, breaks())  # type: ignore[arg-type]
    assert path.read_bytes() == stored.read_bytes()
    assert [p.name for p in tmp_path.glob("[!.]*")] == ["kept.db"]
    assert not list(tmp_path.glob("*.part"))


def test_a_database_in_a_missing_folder_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(VisupError, match="cannot be written"):
        ModelDatabase.create(tmp_path / "nowhere" / "a.db")


def test_the_file_header_has_application_id_and_version(stored: Path) -> None:
    header = stored.read_bytes()[:100]
    assert header.startswith(b"SQLite format 3")
    assert int.from_bytes(header[68:72], "big") == APPLICATION_ID
    assert int.from_bytes(header[60:64], "big") == VERSION


def test_a_mirrored_match_has_the_opposite_direction(stored: Path) -> None:
    database = ModelDatabase.open(stored)
    same = database.query(ZOO["walker"], top=1).matches[0]
    mirrored = database.query(ZOO["walker"][:, ::-1], top=1).matches[0]
    assert (same.view.name, same.terms.mirrored) == ("walker", False)
    assert (mirrored.view.name, mirrored.terms.mirrored) == ("walker", True)
    assert same.direction == (0.0, 0.0, 1.0)
    assert mirrored.direction == (-0.0, -0.0, -1.0)
    assert mirrored.rotation == pytest.approx(0.0, abs=0.1)

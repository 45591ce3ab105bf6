"""Taught views in a database: round trips, older files, refusals, whole or not at all."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from tests.percepts.shape.shapes import ZOO
from visup.agent.model.errors import DatabaseError
from visup.percepts.shape.building.database_builder import silhouette_views
from visup.percepts.shape.database.file_format import OLDEST_VERSION, VERSION, TaughtRow
from visup.percepts.shape.database.model_database import ModelDatabase
from visup.percepts.taught.taught_view import TaughtView, taught_view, taught_view_from_mask

SQUARE = [(40, 20), (90, 20), (90, 60), (40, 60)]


def picture(seed: int = 0, size: tuple[int, int] = (100, 140)) -> NDArray[np.uint8]:
    return np.random.default_rng(seed).integers(0, 256, (*size, 3), dtype=np.uint8)


def equal_views(a: TaughtView, b: TaughtView) -> bool:
    pixels = all(
        np.array_equal(getattr(a, part), getattr(b, part)) for part in ("image", "mask", "scene")
    )
    places = (a.name, a.origin, a.frame_size, a.bbox) == (b.name, b.origin, b.frame_size, b.bbox)
    return pixels and places


@settings(max_examples=15, deadline=None)
@given(
    seed=st.integers(0, 99),
    width=st.integers(8, 900),
    height=st.integers(8, 60),
    share=st.floats(0.05, 1.0),
)
def test_taught_views_are_read_back(
    tmp_path_factory: pytest.TempPathFactory, seed: int, width: int, height: int, share: float
) -> None:
    """Every pixel and every number, whatever the size of the picture and of the outline."""
    mask = np.zeros((height, width), bool)
    mask[: max(5, int(share * height)), -max(5, int(share * width)) :] = True
    view = taught_view_from_mask("a thing", picture(seed, (height, width)), mask)
    path = tmp_path_factory.mktemp("db") / "a.models"
    (read,) = ModelDatabase.open_or_new(path).teach([view]).taught
    assert equal_views(view, read)


def test_teaching_adds_views_without_duplicates(tmp_path: Path) -> None:
    first, second = (taught_view("part", picture(k), SQUARE) for k in range(2))
    other = taught_view("tray", picture(0), SQUARE)
    database = ModelDatabase.create(tmp_path / "a.models").teach([first, other])
    assert database.names() == ("part", "tray")
    database = database.teach([second, first, second])
    assert [v.name for v in database.taught] == ["part", "tray", "part"]
    assert equal_views(database.taught[2], second)
    assert len(database.views) == 0


def test_silhouettes_are_stored_as_views_on_request(tmp_path: Path) -> None:
    mask = np.zeros((300, 300), bool)
    mask[: ZOO["star"].shape[0], : ZOO["star"].shape[1]] = ZOO["star"]
    mask = np.roll(mask, (20, 20), (0, 1))
    view = taught_view_from_mask("star", picture(0, (300, 300)), mask)
    shown = ModelDatabase.create(tmp_path / "a.models").teach([view], silhouettes=True)
    assert shown.query(np.rot90(ZOO["star"])).matches[0].similarity > 0.9
    bare = ModelDatabase.create(tmp_path / "b.models").teach([view])
    assert (bare.names(), len(bare.views)) == (("star",), 0)
    assert bare.query(ZOO["star"]).matches == ()


def test_an_object_cut_by_the_border_is_stored_as_cut(tmp_path: Path) -> None:
    at_border = [(0, 20), (50, 20), (50, 60), (0, 60)]
    database = ModelDatabase.create(tmp_path / "a.models")
    database = database.teach([taught_view("arm", picture(), at_border)], silhouettes=True)
    assert [v.cut for v in database.views] == [True]


def test_an_older_file_is_read_and_upgraded(tmp_path: Path) -> None:
    path = tmp_path / "old.models"
    ModelDatabase.create(path, silhouette_views("star", [ZOO["star"]], 1))
    run_sql("DROP TABLE taught")(path)
    run_sql("DROP TABLE meshes")(path)
    run_sql(f"PRAGMA user_version = {OLDEST_VERSION}")(path)
    database = ModelDatabase.open(path)
    assert (database.names(), database.taught) == (("star",), ())
    database = database.teach([taught_view("part", picture(), SQUARE)])
    assert database.names() == ("star", "part")
    assert int.from_bytes(path.read_bytes()[60:64], "big") == VERSION
    assert database.query(ZOO["star"], top=1).matches[0].view.name == "star"


def test_silhouettes_may_be_added_to_taught_views(tmp_path: Path) -> None:
    database = ModelDatabase.create(tmp_path / "a.models")
    database = database.teach([taught_view("part", picture(), SQUARE)])
    database = database.add(silhouette_views("star", [ZOO["star"]], 1))
    assert (database.names(), len(database.taught)) == (("star", "part"), 1)


@pytest.mark.parametrize("name", ["", "  ", "x" * 201, "two\nlines"])
def test_an_invalid_name_is_refused_and_nothing_is_stored(tmp_path: Path, name: str) -> None:
    database = ModelDatabase.create(tmp_path / "a.models")
    before = database.path.read_bytes()
    good = taught_view("part", picture(), SQUARE)
    with pytest.raises(DatabaseError, match="cannot be called"):
        database.teach([good, taught_view(name, picture(), SQUARE)])
    assert database.path.read_bytes() == before
    assert not list(tmp_path.glob(".*.part"))


def test_a_missing_database_is_created(tmp_path: Path) -> None:
    assert ModelDatabase.open_or_new(tmp_path / "new.models").names() == ()
    (tmp_path / "text").write_text("no database")
    with pytest.raises(DatabaseError, match="can be read"):
        ModelDatabase.open_or_new(tmp_path / "text")


def run_sql(sql: str) -> Callable[[Path], None]:
    def damage(path: Path) -> None:
        with closing(sqlite3.connect(path)) as file, file:
            file.execute(sql)

    return damage


def with_right_sum(column: str, change: Callable[[bytes], bytes]) -> Callable[[Path], None]:
    """The view gets other content, and a check sum that agrees."""

    def damage(path: Path) -> None:
        query = "SELECT name, x, y, width, height, image, mask, scene FROM taught"
        with closing(sqlite3.connect(path)) as file, file:
            name, x, y, width, height, image, mask, scene = file.execute(query).fetchone()
            parts = {"image": image, "mask": mask, "scene": scene}
            parts[column] = change(parts[column])
            crc = TaughtRow(name, (x, y, width, height), **parts).checksum(0)
            file.execute(f"UPDATE taught SET {column} = ?, crc = ?", (parts[column], crc))

    return damage


def huge(png: bytes) -> bytes:
    return png[:16] + (1 << 20).to_bytes(4, "big") * 2 + png[24:]


DAMAGE: dict[str, tuple[Callable[[Path], None], str]] = {
    "other place": (run_sql("UPDATE taught SET x = 3"), "check sum of taught view 1"),
    "other name": (run_sql("UPDATE taught SET name = 'x'"), "check sum of taught view 1"),
    "other pixels": (run_sql("UPDATE taught SET image = x'00'"), "check sum of taught view 1"),
    "text": (run_sql("UPDATE taught SET mask = 'text'"), "check sum of taught view 1"),
    "no number": (run_sql("UPDATE taught SET y = 'far'"), "check sum of taught view 1"),
    "no name": (run_sql("UPDATE taught SET name = x'ff'"), "taught view 1 without a name"),
    "no row": (run_sql("UPDATE taught SET number = 4"), "taught view 1 is missing"),
    "no table": (run_sql("DROP TABLE taught"), "its tables"),
    "older": (run_sql(f"PRAGMA user_version = {OLDEST_VERSION}"), "its tables"),
    "no picture": (with_right_sum("image", lambda b: b[:40]), "a picture that is none"),
    "no PNG": (with_right_sum("scene", lambda b: b"GIF89a" + b), "a picture that is none"),
    "bomb": (with_right_sum("mask", huge), "1048576 x 1048576 pixels"),
}


@pytest.mark.parametrize("case", sorted(DAMAGE))
def test_damage_is_reported(tmp_path: Path, case: str) -> None:
    damage, message = DAMAGE[case]
    path = tmp_path / "bad.models"
    ModelDatabase.create(path).teach([taught_view("part", picture(), SQUARE)])
    damage(path)
    with pytest.raises(DatabaseError) as refused:
        _ = ModelDatabase.open(path).taught
    assert message in refused.value.what
    assert str(path) in str(refused.value)


def test_an_outline_of_a_wrong_size_is_reported_as_damage(tmp_path: Path) -> None:
    path = tmp_path / "bad.models"
    ModelDatabase.create(path).teach([taught_view("part", picture(), SQUARE)])
    with closing(sqlite3.connect(path)) as file:
        (scene,) = file.execute("SELECT scene FROM taught").fetchone()
    with_right_sum("mask", lambda _: bytes(scene))(path)
    with pytest.raises(DatabaseError, match="an outline of another size"):
        _ = ModelDatabase.open(path).taught

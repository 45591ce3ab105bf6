"""`visup models` and the evaluation of retrieval, on silhouettes made here."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np
import pytest
from typer.testing import CliRunner, Result

from tests.paths import SHARED
from tests.percepts.shape.shapes import ZOO, flower, limbs, small_database
from visup.agent.model.errors import DatabaseError, SettingsError, VisupError
from visup.commands.models import app
from visup.evaluation.shape.retrieval import evaluate_shapes
from visup.percepts.shape.database.model_database import ModelDatabase
from visup.percepts.shape.drawing.sheet import COLOURS


def run(*args: object) -> Result:
    return CliRunner().invoke(app, [str(a) for a in args])


def save(mask: np.ndarray, path: Path, invert: bool = False) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    assert cv2.imwrite(str(path), ((mask != invert) * 255).astype(np.uint8))
    return path


@pytest.fixture
def zoo(tmp_path: Path) -> Path:
    return small_database(tmp_path / "zoo.db").path


def test_a_database_is_built_listed_and_shown(tmp_path: Path) -> None:
    trimesh = pytest.importorskip("trimesh", reason="views of meshes need the extra 'render'")
    mesh, db, out = tmp_path / "crate.ply", tmp_path / "m.db", tmp_path / "sheet.png"
    trimesh.creation.box(extents=(1, 2, 3)).export(mesh)
    built = run("build", db, mesh, "--views", 4, "--jobs", 1)
    assert built.exit_code == 0, built.output
    assert "1 models, 4 views" in built.output
    listed = run("list", db)
    assert "crate" in listed.output
    assert run("show", db, "--out", out).exit_code == 0
    sheet = cv2.imread(str(out))
    assert sheet is not None
    assert sheet.std() > 10
    assert run("show", db).exit_code == 0
    np.testing.assert_array_equal(cv2.imread(str(tmp_path / "m-sheet.png")), sheet)
    assert {p.name for p in tmp_path.glob(".*")} == {".m.db.lock"}


@pytest.mark.parametrize("invert", [False, True], ids=["white on black", "black on white"])
def test_a_picture_is_matched_in_either_polarity(zoo: Path, tmp_path: Path, invert: bool) -> None:
    picture = save(np.rot90(ZOO["walker"]), tmp_path / "p.png", invert)
    answer = json.loads(run("match", zoo, picture, "--json", "--top", 2).output)
    assert answer["matches"][0]["object"] == "walker"
    assert len(answer["matches"]) == 2
    table = run("match", zoo, picture).output
    assert "walker" in table
    assert "similarity" in table


def test_silhouettes_are_added_as_a_model(zoo: Path, tmp_path: Path) -> None:
    for k, depth in enumerate((0.1, 0.12, 0.4, 0.42)):
        save(flower(((6, depth),)), tmp_path / "gears" / f"{k}.png")
    added = run("add", zoo, "--name", "gear", "--silhouettes", tmp_path / "gears", "--clusters", 2)
    assert added.exit_code == 0, added.output
    assert f"{len(ZOO) + 1} models, {len(ZOO) + 2} views" in added.output


def test_masks_cut_by_the_border_are_added_as_truncated_views(zoo: Path, tmp_path: Path) -> None:
    whole = ZOO["star"]
    for k in range(6):
        # The star leaves the picture to the left; something else stands beside it.
        frame = np.roll(whole, -30 * k, axis=1).astype(np.uint8) * 7
        frame[:, whole.shape[1] - 30 * k :] = 0
        frame[:12, -40:] = 9
        assert cv2.imwrite(str(make(tmp_path / "masks") / f"{k:05}.png"), frame)
    args = ("add", zoo, "--name", "comet", "--masks", tmp_path / "masks", "--label", 7)
    added = run(*args, "--clusters", 3)
    assert added.exit_code == 0, added.output
    views = [v for v in ModelDatabase.open(zoo).views if v.name == "comet"]
    assert len(views) == 3
    assert any(v.cut for v in views)
    assert not all(v.cut for v in views)
    again = run(*args, "--clusters", 1)
    assert again.exit_code == 0, again.output
    views = [v for v in ModelDatabase.open(zoo).views if v.name == "comet"]
    assert [v.number for v in views] == [0, 1, 2, 3]


def make(folder: Path) -> Path:
    folder.mkdir(exist_ok=True)
    return folder


def test_a_match_is_drawn_with_its_correspondences(zoo: Path, tmp_path: Path) -> None:
    picture, out = save(ZOO["walker"], tmp_path / "p.png"), tmp_path / "why.png"
    drawn = run("match", zoo, picture, "--out", out)
    assert drawn.exit_code == 0, drawn.output
    image = cv2.imread(str(out))
    assert image is not None
    # Every kind of shock that is there shows in its colour, in the legend if nowhere else.
    for red, green, blue in COLOURS.values():
        near = np.abs(image.astype(int) - (blue, green, red)).max(axis=2) < 12
        assert near.sum() > 20
    # The walker itself is the best view: lines join nodes at equal heights, in full colour.
    assert (image[44:216, 500:920].std(axis=2) > 30).sum() > 500


def test_the_table_of_matches_fits_80_columns(
    zoo: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    name = "a_long_name_of_a_model_that_nobody_would_choose"
    picture = save(ZOO["walker"], tmp_path / name / "p.png")
    run("add", zoo, "--name", name, "--silhouettes", picture.parent)
    lines = run("match", zoo, picture).output.splitlines()
    assert max(map(len, lines)) <= 80
    assert "similarity" in "".join(lines)
    assert "0.99" in "".join(lines) or "1.000" in "".join(lines)


@pytest.mark.parametrize(
    ("args", "error"),
    [
        (("match", "zoo.db", "missing.png"), DatabaseError),
        (("match", "missing.db", "walker.png"), DatabaseError),
        (("match", "walker.png", "walker.png"), DatabaseError),
        (("match", "zoo.db", "walker.png", "--top", 0), SettingsError),
        (("match", "zoo.db", "empty.png"), DatabaseError),
        (("add", "zoo.db", "--name", "x", "--silhouettes", "nowhere"), DatabaseError),
        (("add", "zoo.db", "--name", " ", "--silhouettes", "."), SettingsError),
        (("add", "zoo.db", "--name", "x"), SettingsError),
        (("add", "zoo.db", "--name", "x", "--silhouettes", ".", "--masks", "."), SettingsError),
        (("add", "zoo.db", "--name", "x", "--silhouettes", ".", "--label", "3"), SettingsError),
        (("add", "zoo.db", "--name", "x", "--masks", ".", "--label", "3"), DatabaseError),
        (("match", "zoo.db", "walker.png", "--out", "nowhere/a.png"), VisupError),
        (("build", "new.db", "walker.png"), DatabaseError),
        (("build", "new.db", "walker.png", "--views", 0), SettingsError),
        (("show", "zoo.db", "--out", "nowhere/a.png"), VisupError),
    ],
)
def test_invalid_arguments_are_errors_for_the_user(
    zoo: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    args: tuple[object, ...],
    error: type[VisupError],
) -> None:
    monkeypatch.chdir(tmp_path)
    save(ZOO["walker"], tmp_path / "walker.png")
    save(np.zeros((40, 40), bool), tmp_path / "empty.png")
    result = run(*args)
    assert isinstance(result.exception, error)
    assert not (tmp_path / "new.db").exists()


def classes(folder: Path) -> Path:
    for k in range(3):
        save(flower(((5, 0.3 + 0.02 * k),), size=50), folder / "star" / f"{k}.png")
        save(limbs((0.3, 1.2 + 0.1 * k, 4.0)), folder / "walker" / f"{k}.png", invert=k == 1)
    return folder


def test_retrieval_separates_clearly_different_classes(tmp_path: Path) -> None:
    figures = evaluate_shapes(classes(tmp_path))
    total = figures["total"]
    assert total["nn1"] == 1.0
    assert total["bullseye"] == 1.0
    assert total["ranks"] == [6, 6] + [0] * 3 + [0] * 5
    assert total["rank_sum"] == 12
    assert set(figures["items"]) == {"star", "walker"}
    assert {"ms_shape", "ms_pair", "compared", "lost"} <= set(total)
    assert total["lost"] == 0.0


def test_an_evaluation_without_shapes_is_refused(tmp_path: Path) -> None:
    with pytest.raises(SettingsError, match="no shapes"):
        evaluate_shapes(tmp_path)


@pytest.mark.skipif(not (SHARED / "shapes/kimia99").is_dir(), reason="needs the shared data")
def test_retrieval_separates_real_classes() -> None:
    total = evaluate_shapes(SHARED / "shapes/kimia99", limit=4)["total"]
    assert total["nn1"] >= 0.95
    assert total["bullseye"] >= 0.95

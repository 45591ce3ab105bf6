"""`visup models` and the evaluation of retrieval, on silhouettes made here."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np
import pytest
from typer.testing import CliRunner, Result

from tests.shape.shapes import ZOO, flower, limbs, small_database
from visup.agent.errors import DatabaseError, SettingsError, VisupError
from visup.commands.models import app
from visup.evaluation.shapes import evaluate_shapes

SHARED = Path(__file__).resolve().parents[2] / "../shared/data"


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


@pytest.mark.parametrize("invert", [False, True], ids=["white on black", "black on white"])
def test_a_picture_is_matched_whatever_its_polarity(
    zoo: Path, tmp_path: Path, invert: bool
) -> None:
    picture = save(np.rot90(ZOO["walker"]), tmp_path / "p.png", invert)
    answer = json.loads(run("match", zoo, picture, "--json", "--top", 2).output)
    assert answer["matches"][0]["object"] == "walker"
    assert len(answer["matches"]) == 2
    table = run("match", zoo, picture).output
    assert "walker" in table
    assert "similarity" in table


def test_exemplars_are_added_under_a_name(zoo: Path, tmp_path: Path) -> None:
    for k, depth in enumerate((0.1, 0.12, 0.4, 0.42)):
        save(flower(((6, depth),)), tmp_path / "gears" / f"{k}.png")
    added = run("add", zoo, "--name", "gear", "--silhouettes", tmp_path / "gears", "--clusters", 2)
    assert added.exit_code == 0, added.output
    assert f"{len(ZOO) + 1} models, {len(ZOO) + 2} views" in added.output


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
        (("build", "new.db", "walker.png"), DatabaseError),
        (("build", "new.db", "walker.png", "--views", 0), SettingsError),
        (("show", "zoo.db", "--out", "nowhere/a.png"), VisupError),
    ],
)
def test_misuse_is_an_error_for_the_user(
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


def test_classes_that_differ_plainly_are_told_apart(tmp_path: Path) -> None:
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
def test_real_classes_are_told_apart() -> None:
    total = evaluate_shapes(SHARED / "shapes/kimia99", limit=4)["total"]
    assert total["nn1"] >= 0.95
    assert total["bullseye"] >= 0.95

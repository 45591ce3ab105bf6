"""`visup teach`: outlines on the command line and in briefs; messages and refusals."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import pytest
from typer.testing import CliRunner, Result

from tests.teaching.clips import SIDE, TOP, corners, frame
from visup.agent.model.errors import VisupError
from visup.cli import app
from visup.percepts.shape.database.model_database import ModelDatabase


def run(*args: object) -> Result:
    return CliRunner().invoke(app, ["teach", *map(str, args)])


@pytest.fixture
def picture(tmp_path: Path) -> Path:
    path = tmp_path / "cell.png"
    cv2.imwrite(str(path), frame(0))
    return path


def outline_options(name: str, number: int = 0) -> list[str]:
    x, *others = (f"{x},{y}" for x, y in corners(number))
    return ["--outline", f"{name}={x}", *others]


def test_outlines_are_stored_reported_and_drawn(picture: Path, tmp_path: Path) -> None:
    models = tmp_path / "cell.models"
    done = run(picture, *outline_options("part"), *outline_options("tray", 9), "--models", models)
    assert done.exit_code == 0, done.output
    assert f"part: {SIDE} x {SIDE} pixels at (20, {TOP})." in done.output
    assert "has outlines of: part (1 view), tray (1 view)" in done.output
    assert ModelDatabase.open(models).names() == ("part", "tray")
    drawn = cv2.imread(str(tmp_path / "cell-taught.png"))
    assert drawn is not None
    assert drawn.std() > 20
    again = run(picture, *outline_options("part"), "--models", models, "--out", tmp_path / "b.png")
    assert "nothing was added" in again.output
    assert (tmp_path / "b.png").exists()


def test_a_brief_supplies_clips_and_outlines(tmp_path: Path) -> None:
    folder = tmp_path / "clip"
    folder.mkdir()
    cv2.imwrite(str(tmp_path / "f.png"), frame(0))
    kind = cv2.VideoWriter.fourcc(*"mp4v")
    video = cv2.VideoWriter(str(folder / "clip.mp4"), kind, 25.0, (160, 120))
    video.write(frame(0))
    video.release()
    brief = {"teach": {"part": {"clip": "clip", "frame": 0, "polygon": corners(0)}}}
    (folder / "brief.json").write_text(json.dumps(brief))
    done = run("--brief", folder / "brief.json", "--models", tmp_path / "a.models")
    assert done.exit_code == 0, done.output
    assert "part (1 view)" in done.output


@pytest.mark.parametrize(
    ("args", "message"),
    [
        ([], "--models DB"),
        (["--models", "a"], "no clip was given to draw outlines in"),
        (["no.mp4", "--models", "a", *outline_options("part")], "no.mp4"),
        (["cell.png", "--models", "a", "--outline", "part"], "has no name"),
        (["cell.png", "--models", "a", *outline_options("part"), "--frame", "4"], "no frame 4"),
        (["cell.png", "--models", "a", "--brief", "b.json"], "a brief already contains"),
        (["--models", "a", "--brief", "b.json"], "cannot be read"),
        (["cell.png", "--models", "no/a", *outline_options("part")], "cannot be written"),
    ],
)
def test_invalid_input_is_refused(
    picture: Path, monkeypatch: pytest.MonkeyPatch, args: list[str], message: str
) -> None:
    monkeypatch.chdir(picture.parent)
    refused = run(*args)
    assert isinstance(refused.exception, VisupError)
    assert message in str(refused.exception)
    assert not Path("a").exists()


def test_adding_models_creates_the_database(tmp_path: Path) -> None:
    cv2.imwrite(str(tmp_path / "silhouettes.png"), frame(0)[:, :, 2])
    folder = tmp_path / "pictures"
    folder.mkdir()
    (tmp_path / "silhouettes.png").rename(folder / "a.png")
    args = ["models", "add", tmp_path / "new.models", "--name", "part", "--silhouettes", folder]
    done = CliRunner().invoke(app, [*map(str, args), "--clusters", "1"])
    assert done.exit_code == 0, done.output
    assert ModelDatabase.open(tmp_path / "new.models").names() == ("part",)

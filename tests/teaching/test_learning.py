"""Learning from runs: clear, different frames of what was confirmed, and errors where there are none."""

from __future__ import annotations

import shutil
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from typer.testing import CliRunner

import visup
from visup.agent.model.errors import VisupError
from visup.cli import app
from visup.percepts.shape.database.model_database import ModelDatabase
from visup.teaching.learning import Sighting, clear, learn_from, spread
from visup.testing import crossing
from visup.testing.clips import region_of

FRAMES = 30


def sighting(
    frame: int, x: int, side: int = 20, hidden: float = 0.0, shared: bool = False
) -> Sighting:
    mask = np.zeros((120, 400), bool)
    mask[40 : 40 + side, x : x + side] = True
    return Sighting(frame, region_of(mask, 1), hidden, shared)


PLACES = st.lists(st.tuples(st.integers(0, 300), st.integers(8, 60)), min_size=1, max_size=30)


@given(PLACES, st.integers(1, 8))
def test_at_most_so_many_views_are_chosen_in_order_without_repetition(
    places: list[tuple[int, int]], most: int
) -> None:
    seen = [sighting(n, x, side) for n, (x, side) in enumerate(places)]
    chosen = [s.frame for s in spread(seen, most)]
    assert chosen == sorted(set(chosen))
    assert 1 <= len(chosen) <= most


def test_chosen_views_differ() -> None:
    """Of a long rest and a short move, both are shown."""
    seen = [sighting(n, 10) for n in range(90)] + [sighting(90 + n, 10 + 30 * n) for n in range(8)]
    assert {s.region.bbox[0] for s in spread(seen, 4)} >= {10, 220}


def test_the_clearer_half_is_kept() -> None:
    covered = [sighting(n, 10, hidden=0.8) for n in range(0, 10)]
    free = [sighting(n, 10) for n in range(10, 20)]
    assert [s.frame for s in clear([*covered, *free])] == list(range(10, 20))


def test_regions_of_two_objects_are_left_out() -> None:
    two = [sighting(n, 10, shared=True) for n in range(9)]
    assert clear(two) == []
    assert [s.frame for s in clear([*two, sighting(9, 30)])] == [9]


def test_sightings_whose_size_jumps_are_left_out() -> None:
    sides = [20, 20, 20, 44, 20, 20, 20]
    assert 3 not in {s.frame for s in clear([sighting(n, 10, d) for n, d in enumerate(sides)])}


@pytest.fixture(scope="module")
def clip(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("clip")
    for number, shot in enumerate(crossing(FRAMES)):
        cv2.imwrite(str(folder / f"{number:04}.png"), shot.frame.image)
    return folder


@pytest.fixture(scope="module")
def run(clip: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("run") / "run"
    visup.watch(clip, fps=25, out=folder).finish()
    return folder


def first_object(run: Path) -> int:
    return min(o.id for o in visup.open_run(run).objects if o.confirmed)


def test_confirmed_objects_become_views(run: Path, clip: Path, tmp_path: Path) -> None:
    number = first_object(run)
    models = visup.learn(run, models=tmp_path / "a.models", things={"disc": number}, views=3)
    assert models.names() == ("disc",)
    assert 2 <= len(models.taught) <= 3
    assert len({v.origin for v in models.taught}) == len(models.taught)
    for view in models.taught:
        own, around = view.image[view.mask], view.image[~view.mask]
        assert np.abs(own.mean(axis=0) - around.mean(axis=0)).max() > 20
    again = visup.learn(run, models=models, things={"disc": number}, views=3)
    assert len(again.taught) == len(models.taught)
    moved = shutil.copytree(clip, tmp_path / "moved")
    lesson = learn_from(run, tmp_path / "b.models", {"disc": number}, str(moved), 3)
    assert len(lesson.views) == len(models.taught)


def command(*args: object) -> tuple[int, str]:
    done = CliRunner().invoke(app, ["models", "learn", *map(str, args)])
    told = str(done.exception) if isinstance(done.exception, VisupError) else done.output
    return done.exit_code, told


def test_the_command_reports_and_draws_the_views(run: Path, tmp_path: Path) -> None:
    models = tmp_path / "a.models"
    code, told = command(run, "--models", models, "--thing", f"disc={first_object(run)}")
    assert code == 0, told
    assert "has outlines of: disc" in told
    assert (tmp_path / "a-taught.png").exists()
    shown = CliRunner().invoke(app, ["models", "show", str(models)])
    assert shown.exit_code == 0, shown.output
    sheet = cv2.imread(str(tmp_path / "a-sheet.png"))
    assert sheet is not None
    listed = CliRunner().invoke(app, ["models", "list", str(models)])
    assert "taught" in listed.output


@pytest.mark.parametrize(
    ("args", "message"),
    [
        (["--thing", "disc"], "cannot be read"),
        (["--thing", "=1"], "cannot be read"),
        (["--thing", "disc=a"], "cannot be read"),
        (["--thing", "disc=1", "--thing", "disc=2"], "twice"),
        (["--thing", "disc=99"], "no object 99"),
        ([], "no object of this run was identified"),
        (["--thing", "disc=1", "--source", "gone.mp4"], "gone.mp4"),
    ],
)
def test_errors_of_learning_are_reported(
    run: Path, tmp_path: Path, args: list[str], message: str
) -> None:
    code, told = command(run, "--models", tmp_path / "a.models", *args)
    assert code != 0
    assert message in told
    assert not (tmp_path / "a.models").exists()


def test_another_video_is_refused(run: Path, tmp_path: Path) -> None:
    other = tmp_path / "other"
    other.mkdir()
    for number in range(FRAMES):
        cv2.imwrite(str(other / f"{number:04}.png"), np.zeros((50, 60, 3), np.uint8))
    with pytest.raises(VisupError, match="not the video of the run"):
        learn_from(run, tmp_path / "a.models", {"disc": first_object(run)}, str(other), 3)


def test_answers_of_the_operator_confirm_objects(clip: Path, run: Path, tmp_path: Path) -> None:
    models = ModelDatabase.create(tmp_path / "known.models")
    number = first_object(run)
    models = visup.learn(run, models=models, things={"disc": number}, views=1)
    args = ["watch", str(clip), "--fps", "25", "--models", str(models.path), "--no-video"]
    out = tmp_path / "answered"
    done = CliRunner().invoke(app, [*args, "--answer", f"{number}=disc", "--out", str(out)])
    assert done.exit_code in (0, 1), done.output
    code, told = command(out, "--models", tmp_path / "b.models")
    assert code == 0, told
    assert ModelDatabase.open(tmp_path / "b.models").names() == ("disc",)

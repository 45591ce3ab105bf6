"""Teaching a clicked object stores its pixels at that moment as a view."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from tests.archive.recordings import record
from tests.clips import write_clip
from tests.console.test_runs import SETTINGS, ambiguous_observations
from visup.agent.model.errors import VisupError
from visup.console.run_view import RunView
from visup.console.workbench.object_teaching import MODELS, teach_object
from visup.percepts.shape.database.model_database import ModelDatabase

COUNT = 12


@pytest.fixture
def run(tmp_path: Path) -> RunView:
    """Object 1 is a box of 80 x 60 pixels at (200 + i, 200) in frame i, with a colour that depends on i."""
    images = []
    for i in range(COUNT):
        image = np.full((480, 640, 3), 60, np.uint8)
        cv2.rectangle(image, (200 + i, 200), (279 + i, 259), (20, 20 * i, 220), -1)
        images.append(image)
    clip = write_clip(tmp_path / "clip.avi", images, fps=10.0)
    record(tmp_path / "run", ambiguous_observations(COUNT), SETTINGS, source=str(clip))
    return RunView(tmp_path / "run")


@pytest.mark.parametrize("number", [4, 9])
def test_a_taught_view_has_the_pixels_of_the_object_at_that_moment(
    run: RunView, tmp_path: Path, number: int
) -> None:
    (view,) = teach_object(run, number, 1, "box", tmp_path).views
    assert view.frame_size == (640, 480)
    _, green, red = view.image[view.mask].mean(axis=0)
    assert abs(green - 20 * number) < 12
    assert red > 180
    assert view.mask.sum() == pytest.approx(80 * 60, rel=0.05)


def test_views_of_a_model_accumulate(run: RunView, tmp_path: Path) -> None:
    for number in (3, 10):
        teach_object(run, number, 1, "box", tmp_path)
    database = ModelDatabase.open(tmp_path / MODELS)
    assert [v.name for v in database.taught] == ["box", "box"]


@pytest.mark.parametrize(("object_id", "name"), [(9, "box"), (1, ""), (1, "a\nb")])
def test_missing_objects_and_invalid_names_are_refused(
    run: RunView, tmp_path: Path, object_id: int, name: str
) -> None:
    with pytest.raises(VisupError):
        teach_object(run, 5, object_id, name, tmp_path)
    assert not (tmp_path / MODELS).exists()


def test_without_its_video_nothing_is_taught(tmp_path: Path) -> None:
    record(
        tmp_path / "run", ambiguous_observations(COUNT), SETTINGS, source=str(tmp_path / "gone.avi")
    )
    with pytest.raises(VisupError, match="the video is no longer available"):
        teach_object(RunView(tmp_path / "run"), 5, 1, "box", tmp_path)
    assert not (tmp_path / MODELS).exists()

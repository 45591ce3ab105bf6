"""Teaching from clips, pictures, arrays and briefs: what is stored is what was shown."""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

import visup
from tests.paths import SHARED
from tests.teaching.clips import SIDE, SIZE, TOP, corners, frame, write_clip
from visup.agent.model.errors import SettingsError, SourceError, VisupError
from visup.percepts.shape.database.model_database import ModelDatabase
from visup.teaching.briefs import read_clip_outlines
from visup.teaching.clip_frames import ClipFrames
from visup.teaching.outline_teaching import teach_brief, views_of


@pytest.fixture(scope="module")
def clip(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_clip(tmp_path_factory.mktemp("clip") / "clip.avi")


@pytest.mark.parametrize("order", [(0, 1, 80, 3, 79, 81, 0), (89, 0), (50, 50, 49)])
def test_frames_are_read_by_number(clip: Path, order: tuple[int, ...]) -> None:
    """In whatever order they are asked for."""
    with ClipFrames(str(clip)) as frames:
        assert frames.count == 90
        for number in order:
            np.testing.assert_array_equal(frames.at(number), frame(number))


@pytest.mark.parametrize("number", [-1, 90, 5000])
def test_a_missing_frame_is_reported(clip: Path, number: int) -> None:
    with ClipFrames(str(clip)) as frames:
        with pytest.raises(SourceError, match=f"no frame {number}") as refused:
            frames.at(number)
        assert refused.value.expected == "0 to 89"
        np.testing.assert_array_equal(frames.at(7), frame(7))


def test_a_picture_is_a_clip_of_one_frame(tmp_path: Path) -> None:
    path = tmp_path / "a.png"
    cv2.imwrite(str(path), frame(5))
    with ClipFrames(str(path)) as frames:
        assert frames.count == 1
        np.testing.assert_array_equal(frames.at(0), frame(5))
        with pytest.raises(SourceError, match="no frame 1"):
            frames.at(1)


def test_a_video_a_picture_and_an_array_teach_the_same(clip: Path, tmp_path: Path) -> None:
    picture = tmp_path / "a.png"
    cv2.imwrite(str(picture), frame(12))
    mask = np.zeros(SIZE[::-1], bool)
    mask[TOP : TOP + SIDE, 32 : 32 + SIDE] = True
    ways: list[tuple[Any, Any, int]] = [
        (clip, corners(12), 12),
        (picture, corners(12), 0),
        (frame(12), corners(12), 0),
        (frame(12), mask, 0),
    ]
    for number, (source, drawn, at) in enumerate(ways):
        models = tmp_path / f"{number}.models"
        (view,) = visup.teach(source, {"part": drawn}, models=models, frame=at).taught
        assert view.bbox == (32, TOP, SIDE, SIDE)
        assert (view.image[view.mask] == (30, 30, 220)).all()


def test_teaching_adds_views_to_a_database(clip: Path, tmp_path: Path) -> None:
    models = visup.teach(clip, {"part": corners(0)}, models=tmp_path / "a.models")
    models = visup.teach(clip, {"part": corners(9), "tray": corners(9)}, models=models, frame=9)
    assert [v.name for v in models.taught] == ["part", "part", "tray"]
    assert visup.ModelDatabase.open(tmp_path / "a.models").names() == ("part", "tray")


@pytest.mark.parametrize(
    ("outlines", "message"),
    [
        ({}, "nothing was outlined"),
        ({"part": [(1, 1), (2, 2)]}, "too few corners"),
        ({"part": corners(0), "tray": [(900, 900), (950, 900), (950, 950)]}, "nothing in the outl"),
        ({"part": np.ones((4, 4), bool)}, "mask of 'part' is of shape"),
        ({" ": corners(0)}, "cannot be called"),
    ],
)
def test_an_empty_outline_is_refused_and_no_database_created(
    tmp_path: Path, outlines: Any, message: str
) -> None:
    with pytest.raises(VisupError, match=message):
        visup.teach(frame(0), outlines, models=tmp_path / "a.models")
    assert not (tmp_path / "a.models").exists()


def brief(tmp_path: Path, content: Any) -> Path:
    for name in ("first", "second"):
        (tmp_path / name).mkdir(exist_ok=True)
        if not (tmp_path / name / "clip.mp4").exists():
            write_clip(tmp_path / name / "clip.avi", 3).rename(tmp_path / name / "clip.mp4")
    path = tmp_path / "second" / "brief.json"
    path.write_text(content if isinstance(content, str) else json.dumps(content))
    return path


def drawn(clip: str, number: int) -> dict[str, Any]:
    return {"clip": clip, "frame": number, "polygon": corners(number)}


def test_outlines_in_the_own_clip_of_a_brief_take_precedence(tmp_path: Path) -> None:
    content = {
        "teach": {"part": drawn("first", 0), "tray": drawn("first", 1)},
        "teach_own": {"part": drawn("second", 2)},
        "teach_extra": {"hand": drawn("second", 1)},
    }
    path = brief(tmp_path, content)
    lesson = teach_brief(path.parent, tmp_path / "a.models")
    assert {v.name: v.bbox[0] for v in lesson.views} == {"part": 22, "tray": 21, "hand": 21}
    assert set(lesson.database.names()) == {"part", "tray", "hand"}
    again = teach_brief(path, tmp_path / "a.models")
    assert "nothing was added" in again.messages[-1]
    assert len(again.database.taught) == 3


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("{", "not JSON"),
        ("[]", "no mapping"),
        ({}, "teaches nothing"),
        ({"teach": []}, "no mapping of names"),
        ({"teach": {"part": {"clip": "first"}}}, "no 'polygon'"),
        ({"teach": {"part": {"clip": "first", "polygon": [1, 2]}}}, "'part'"),
        ({"teach": {"part": drawn("third", 0)}}, "'third' is not there"),
    ],
)
def test_an_invalid_brief_is_refused(tmp_path: Path, content: Any, message: str) -> None:
    path = brief(tmp_path, content)
    with pytest.raises(SettingsError, match=message) as refused:
        teach_brief(path, tmp_path / "a.models")
    assert str(path) in str(refused.value)


def test_a_missing_brief_is_reported(tmp_path: Path) -> None:
    with pytest.raises(SettingsError, match="cannot be read"):
        teach_brief(tmp_path / "no.json", tmp_path / "a.models")


def test_the_report_of_a_view_has_size_position_and_warnings(clip: Path, tmp_path: Path) -> None:
    small = [(0, 0), (9, 0), (9, 9), (0, 9)]
    content = {"teach": {"dot": {"clip": "first", "frame": 0, "polygon": small}}}
    lesson = teach_brief(brief(tmp_path, content), tmp_path / "a.models")
    assert "10 x 10 pixels at (0, 0), cut by the picture's border" in lesson.messages[0]
    assert "hard to find again" in lesson.messages[0]
    assert lesson.messages[-1].endswith("has outlines of: dot (1 view).")


@pytest.mark.skipif(not SHARED.is_dir(), reason="the shared data is not there")
def test_every_shared_brief_is_read_and_an_object_taught_within_a_second(tmp_path: Path) -> None:
    briefs = sorted(SHARED.glob("*/*/brief.json"))
    assert all(read_clip_outlines(path) for path in briefs)
    views = views_of(read_clip_outlines(briefs[0]))
    database = ModelDatabase.open_or_new(tmp_path / "a.models")
    begun = time.process_time()
    database.teach(views)
    assert (time.process_time() - begun) / len(views) < 1.0

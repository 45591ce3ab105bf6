from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from tests.paths import SHARED
from visup.agent.model.errors import SettingsError
from visup.evaluation.machines.clips import clip_folders, parse_truth, read_brief, read_truth
from visup.evaluation.machines.runner import clip_settings

OUTLINE = {"clip": "one", "frame": 3, "polygon": [[0, 0], [9, 0], [9, 9]]}
TASK = "<lift> ::= coupled(gripper, part)\n"


@pytest.fixture
def clip(tmp_path: Path) -> Path:
    """A clip without pictures: what is told of it alone is read."""
    folder = tmp_path / "one"
    folder.mkdir()
    (folder / "clip.mp4").touch()
    (folder / "own.task").write_text(TASK, encoding="utf-8")
    return folder


def write_brief(folder: Path, **fields: Any) -> None:
    (folder / "brief.json").write_text(json.dumps({"task": "own.task", **fields}), encoding="utf-8")


def test_outlines_in_the_clip_itself_replace_those_in_other_clips(
    clip: Path,
) -> None:
    elsewhere = {**OUTLINE, "frame": 8}
    write_brief(clip, teach={"part": elsewhere, "gripper": elsewhere}, teach_own={"part": OUTLINE})
    assert {s.name: s.frame for s in read_brief(clip).actors} == {"part": 3, "gripper": 8}


def test_objects_that_are_no_actors_are_taught_but_not_bound(clip: Path) -> None:
    write_brief(
        clip,
        teach={"part": OUTLINE, "gripper": OUTLINE, "lamp": OUTLINE},
        teach_extra={"hand": OUTLINE},
    )
    brief = read_brief(clip)
    assert [o.name for o in brief.others] == ["hand"]
    assert clip_settings(brief).actors == {"part": ("part",), "gripper": ("gripper",)}


def test_a_brief_without_a_task_is_refused(clip: Path) -> None:
    (clip / "brief.json").write_text(json.dumps({"teach": {"part": OUTLINE}}), encoding="utf-8")
    with pytest.raises(SettingsError, match='names no "task"'):
        read_brief(clip)


@pytest.mark.parametrize(
    "fields",
    [{}, {"teach": {"part": {"frame": 0}}}, {"teach": {"part": {**OUTLINE, "frame": "x"}}}],
)
def test_a_malformed_brief_is_refused(clip: Path, fields: dict[str, Any]) -> None:
    write_brief(clip, **fields)
    with pytest.raises(SettingsError):
        read_brief(clip)


def test_a_folder_without_briefs_is_refused(tmp_path: Path) -> None:
    with pytest.raises(SettingsError):
        clip_folders(tmp_path)


def test_missing_boxes_are_not_scored() -> None:
    truth = parse_truth({"boxes": [{"frame": 2, "part": None, "tray": [1, 2, 3, 4]}]})
    assert truth.boxes[0].boxes == {"tray": (1, 2, 3, 4)}


def test_a_tolerance_is_never_less_than_seven_tenths() -> None:
    assert parse_truth({"tolerance_s": 0.2}).tolerance_s == 0.7
    assert parse_truth({"tolerance_s": 1.5}).tolerance_s == 1.5


def test_a_verdict_is_accepted_where_no_list_is_given() -> None:
    assert parse_truth({"verdict": "failed"}).accept == {"failed"}
    assert parse_truth({"verdict": "failed", "accept": ["in_progress"]}).accept == {"in_progress"}


@pytest.mark.skipif(not (SHARED / "machines").is_dir(), reason="no shared data beside the checkout")
@pytest.mark.parametrize("kind", ["machines", "worlds"])
def test_all_shared_briefs_can_be_read(kind: str) -> None:
    for folder in clip_folders(SHARED / kind):
        brief, truth = read_brief(folder), read_truth(folder)
        assert clip_settings(brief).actors
        assert truth.accept

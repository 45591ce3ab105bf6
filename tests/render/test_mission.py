"""Mission folders: files and ground truth."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from typer.testing import CliRunner

from visup.agent.model.errors import ExtraMissingError, OutputError, SettingsError
from visup.commands.render import parse_size, require_renderer
from visup.render.imaging.renderer import Renderer
from visup.render.output.truth import presence_events, spin_deg_per_s
from visup.render.output.writer import write_mission
from visup.render.scenario.library import shipped_scenario

TINY = (96, 72)


def frames(whole: list[int], visible: list[int]) -> list[dict[str, Any]]:
    return [
        {"index": k, "cat": {"amodal_px": a, "visible_px": v}}
        for k, (a, v) in enumerate(zip(whole, visible, strict=True))
    ]


@pytest.mark.parametrize(
    ("whole", "visible", "expected"),
    [
        ([100, 100, 100], [100, 90, 100], [("entry", 0)]),
        ([0, 5, 10, 100, 9], [0, 5, 10, 100, 9], [("entry", 2), ("exit", 4)]),
        (
            [100] * 6,
            [100, 19, 40, 49, 50, 100],
            [("entry", 0), ("occlusion", 1), ("reappearance", 4)],
        ),
        ([100] * 3, [100, 20, 100], [("entry", 0)]),
        ([100, 100, 5], [100, 0, 0], [("entry", 0), ("occlusion", 1), ("exit", 2)]),
        ([0, 0], [0, 0], []),
    ],
)
def test_presence_events_follow_from_visible_and_amodal_areas(
    whole: list[int], visible: list[int], expected: list[tuple[str, int]]
) -> None:
    events = presence_events("cat", frames(whole, visible))
    assert [(e["kind"], e["frame"]) for e in events] == expected


def test_spin_is_measured_from_poses() -> None:
    assert spin_deg_per_s(Renderer(shipped_scenario("over_earth")), "satellite") == pytest.approx(
        2.0, abs=0.01
    )


@pytest.fixture(scope="module")
def mission(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("mission") / "crossing"
    s = shipped_scenario("crossing").resized(TINY)
    slow = s.model_copy(update={"camera": s.camera.model_copy(update={"fps": 2.0})})
    write_mission(slow, out)
    return out


def test_a_mission_folder_has_mission_and_truth(mission: Path) -> None:
    truth = json.loads((mission / "truth.json").read_text())
    record = json.loads((mission / "mission.json").read_text())
    assert record == {
        "task": "dock",
        "actors": {"satellite": "spartan"},
        "fov_vertical_deg": 38.0,
        "fps": 2.0,
        "size": [96, 72],
    }
    assert truth["labels"] == {"satellite": 3, "astronaut": 4}
    assert truth["verdict"] == "interrupted"
    assert [f["index"] for f in truth["frames"]] == list(range(28))
    kinds = {(e["kind"], e["object"]) for e in truth["events"]}
    assert ("occlusion", "satellite") in kinds
    assert ("reappearance", "satellite") in kinds
    assert ("entry", "astronaut") in kinds


def test_masks_agree_with_the_truth(mission: Path) -> None:
    truth = json.loads((mission / "truth.json").read_text())
    for frame in truth["frames"]:
        path = mission / "masks" / f"{frame['index']:05d}.png"
        mask = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
        assert mask is not None
        assert mask.shape == (72, 96)
        for name, label in truth["labels"].items():
            assert np.count_nonzero(mask == label) == frame[name]["visible_px"]


def test_the_video_has_every_frame(mission: Path) -> None:
    video = cv2.VideoCapture(str(mission / "video.mp4"))
    count = 0
    while video.read()[0]:
        count += 1
    assert count == 28
    assert video.get(cv2.CAP_PROP_FPS) == pytest.approx(2.0)


def test_a_folder_that_is_not_empty_is_refused(mission: Path) -> None:
    s = shipped_scenario("crossing").resized(TINY)
    before = sorted(p.name for p in mission.iterdir())
    with pytest.raises(OutputError, match="not empty"):
        write_mission(s, mission)
    assert sorted(p.name for p in mission.iterdir()) == before


def test_a_folder_that_cannot_be_made_is_reported(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match="cannot be made"):
        write_mission(shipped_scenario("crossing").resized(TINY), tmp_path / "file" / "out")


def test_an_unknown_container_is_refused_before_writing(tmp_path: Path) -> None:
    with pytest.raises(SettingsError, match=r"\.mov"):
        write_mission(shipped_scenario("crossing"), tmp_path / "out", ".mov")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(("text", "size"), [("320x240", (320, 240)), ("16x8192", (16, 8192))])
def test_sizes_are_parsed(text: str, size: tuple[int, int]) -> None:
    assert parse_size(text) == size


@pytest.mark.parametrize("text", ["", "320", "320x", "ax b", "8x8", "320x9000", "3.5x20", "-3x20"])
def test_invalid_sizes_are_refused(text: str) -> None:
    with pytest.raises(SettingsError, match="size"):
        parse_size(text)


def test_the_command_renders_a_scenario_file(tmp_path: Path) -> None:
    from visup.cli import app

    path = tmp_path / "s.toml"
    path.write_text(
        'name = "s"\nduration_s = 0.5\n[camera]\nsize = [64, 48]\nfps = 8\n'
        "track = [{ position = [0, 0, 0], look_at = [1, 0, 0] }]\n[light]\nsun = [-1, 0, 0]\n"
        '[[object]]\nname = "pig"\nmesh = "pig"\nlabel = 1\ntrack = [{ position = [3, 0, 0] }]\n'
    )
    out = tmp_path / "out"
    result = CliRunner().invoke(app, ["render", str(path), "--out", str(out), "--container", "avi"])
    assert result.exit_code == 0, result.output
    assert (out / "video.avi").stat().st_size > 0
    assert len(list((out / "masks").iterdir())) == 4


def test_without_the_extra_the_command_names_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(sys.modules, "embreex", None)
    with pytest.raises(ExtraMissingError, match="'render'"):
        require_renderer()

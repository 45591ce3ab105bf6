"""A clip made here is taught, watched and scored: by its masks, and by the baseline's boxes."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from visup.agent.model.errors import SettingsError
from visup.evaluation.machines.clips import read_brief
from visup.evaluation.machines.runner import evaluate_machines, watch_boxes, watch_by_masks
from visup.evaluation.machines.scores import box_iou

SIZE, FPS, COUNT = (160, 120), 15, 30
TASK = "<meet> ::= <nearing>\n<nearing> ::= converging(ball, post)\n"


def post_box() -> tuple[int, int, int, int]:
    return 110, 30, 20, 60


def ball_box(n: int) -> tuple[int, int, int, int]:
    return 10 + 2 * n, 50, 24, 24


@pytest.fixture(scope="module")
def world(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A bright box that goes towards another one on a textured ground."""
    folder = tmp_path_factory.mktemp("worlds") / "meet"
    (folder / "masks").mkdir(parents=True)
    ground = np.random.default_rng(0).integers(60, 90, (*SIZE[::-1], 3)).astype(np.uint8)
    codec = cv2.VideoWriter.fourcc(*"mp4v")
    video = cv2.VideoWriter(str(folder / "video.mp4"), codec, FPS, SIZE)
    for n in range(COUNT):
        picture, mask = ground.copy(), np.zeros(SIZE[::-1], np.uint8)
        for value, box, colour in (
            (2, ball_box(n), (40, 200, 230)),
            (3, post_box(), (200, 60, 60)),
        ):
            x, y, w, h = box
            picture[y : y + h, x : x + w] = colour
            mask[y : y + h, x : x + w] = value
        video.write(picture)
        cv2.imwrite(str(folder / "masks" / f"{n:05d}.png"), mask)
    video.release()
    write_documents(folder)
    return folder


def corners(box: tuple[int, int, int, int]) -> list[list[int]]:
    x, y, w, h = box
    return [[x, y], [x + w - 1, y], [x + w - 1, y + h - 1], [x, y + h - 1]]


def write_documents(folder: Path) -> None:
    (folder / "meet.task").write_text(TASK, encoding="utf-8")
    outlines = {"ball": corners(ball_box(0)), "post": corners(post_box())}
    teach = {n: {"clip": "meet", "frame": 0, "polygon": c} for n, c in outlines.items()}
    brief = {"name": "meet", "family": "meet", "task": "meet.task", "teach": teach}
    truth = {
        "labels": {"ball": 2, "post": 3},
        "fps": FPS,
        "stages": [{"stage": "nearing", "from_s": 0.6, "to_s": 2.0, "outcome": "complete"}],
        "verdict": "in_progress",
        "accept": ["in_progress", "succeeded"],
        "boxes": [{"frame": n, "ball": ball_box(n), "post": post_box()} for n in (10, 20)],
    }
    (folder / "brief.json").write_text(json.dumps(brief), encoding="utf-8")
    (folder / "truth.json").write_text(json.dumps(truth), encoding="utf-8")


def test_reports_from_masks_agree_with_the_truth(world: Path) -> None:
    total = evaluate_machines(world, eyes=True)["total"]
    assert (total["actors"], total["verdicts_right"]) == (1.0, 1)


def test_the_baseline_tracks_boxes(world: Path) -> None:
    boxes = watch_boxes(read_brief(world)).boxes or {}
    assert box_iou(boxes[20]["ball"], ball_box(20)) > 0.5


def test_only_the_requested_frames_are_watched(world: Path) -> None:
    assert set(watch_by_masks(read_brief(world), 5).boxes or {}) == set(range(5))


def test_a_clip_without_masks_is_refused_for_ideal_perception(tmp_path: Path) -> None:
    (tmp_path / "brief.json").write_text("{}", encoding="utf-8")
    with pytest.raises(SettingsError, match="masks"):
        evaluate_machines(tmp_path, eyes=True)


def test_a_world_is_watched_from_pixels_and_by_the_baseline(world: Path) -> None:
    figures = evaluate_machines(world, limit=4)
    assert set(figures) == {"total", "items", "baseline"}
    assert {"verdicts", "ms", "false_alerts_per_min"} <= set(figures["baseline"])

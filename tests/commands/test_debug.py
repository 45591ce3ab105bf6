"""`visup debug motion`: the video of the segmenter's workings."""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from tests.clips import moving_disc, write_clip
from visup.agent import Frame, Region
from visup.cli import main
from visup.commands.debug import video_of
from visup.percepts.motion.output.segmentation_trace import SegmentationTrace
from visup.percepts.motion.segmenter import MotionSegmenter
from visup.report.motion_debug.marks import flow_colours
from visup.report.motion_debug.panels import (
    draw_motion,
    explained_by,
    label_colours,
    layer_rows,
    velocities,
)

SIZE = (192, 144)
SegmentedFrame = tuple[Frame, SegmentationTrace, tuple[Region, ...]]


@pytest.fixture(scope="module")
def clip(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_clip(tmp_path_factory.mktemp("clip") / "disc.avi", moving_disc(30, SIZE))


@pytest.fixture(scope="module")
def segmented() -> SegmentedFrame:
    """The disc after a second: it goes one pixel per frame to the right."""
    segmenter = MotionSegmenter()
    for n, image in enumerate(moving_disc(30, SIZE)):
        frame = Frame(n, n / 25, image)
        regions = segmenter.step(frame)
    assert segmenter.trace is not None
    return frame, segmenter.trace, regions


def run(monkeypatch: pytest.MonkeyPatch, *arguments: object) -> int:
    monkeypatch.setattr(sys, "argv", ["visup", "debug", "motion", *map(str, arguments)])
    try:
        main()
    except SystemExit as end:
        return int(end.code or 0)
    return 0


def panels(picture: NDArray[np.uint8]) -> list[NDArray[np.uint8]]:
    half_h, half_w = (picture.shape[0] - 26) // 2, picture.shape[1] // 2
    rows = (picture[26:half_h], picture[half_h + 26 : 2 * half_h])
    return [part for row in rows for part in (row[:, : half_w - 2], row[:, half_w + 2 :])]


def test_the_video_has_the_requested_frames(
    clip: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    out = tmp_path / "seen.webm"
    assert run(monkeypatch, clip, "--out", out, "--every", 2, "--limit", 12) == 0
    assert capsys.readouterr().out == f"12 frames in {out}\n"
    video = cv2.VideoCapture(str(out))
    pictures = []
    while (frame := video.read())[0]:
        pictures.append(frame[1])
    assert len(pictures) == 12
    assert pictures[0].shape[1] == 1284
    for panel in panels(np.asarray(pictures[-1], np.uint8)):
        assert panel.std() > 5
        assert np.ptp(panel.astype(int), axis=2).max() > 60  # something in it is coloured


def test_panels_distinguish_the_disc_from_the_background(segmented: SegmentedFrame) -> None:
    _, trace, regions = segmented
    assert len(regions) == 1
    speed, layer = velocities(trace)
    (key,) = (k for k, t in enumerate(trace.tracks, 1) if t.id == regions[0].id)
    assert np.allclose(np.median(speed[layer == key], axis=0), (25, 0), atol=2)
    assert np.allclose(np.median(speed[layer == 0], axis=0), 0, atol=2)
    for m in trace.scene.measured:
        explained = explained_by(trace, m)
        x, y = m.constraints.xy.T
        inside = np.hypot(x - regions[0].centroid[0], y - regions[0].centroid[1]) < 9
        assert (explained[inside] == key).mean() > 0.8
        assert (
            explained[np.hypot(x - regions[0].centroid[0], y - regions[0].centroid[1]) > 40] <= 0
        ).all()
    texts = [text for text, _ in layer_rows(trace)]
    assert texts[0].startswith("background")
    assert any(text.startswith(f"{regions[0].id} (layer ") and "+25." in text for text in texts)


def test_drawing_is_pure_and_its_size_constant(segmented: SegmentedFrame) -> None:
    frame, trace, regions = segmented
    before = frame.image.copy()
    picture = draw_motion(frame, trace, regions)
    assert np.array_equal(picture, draw_motion(frame, trace, regions))
    assert np.array_equal(frame.image, before)
    # The first frame of a video, which has nothing to be compared with, must fit as well.
    assert draw_motion(frame, None, ()).shape == picture.shape


def test_mixed_superpixels_are_uncertain(segmented: SegmentedFrame) -> None:
    _, trace, _ = segmented
    count, labels = trace.posterior.shape
    sure = np.zeros((count, labels), np.float32)
    sure[:, 0] = 1
    even = np.full((count, labels), 1 / labels, np.float32)
    for posterior, unsure in ((sure, False), (even, True)):
        changed = replace(trace, posterior=posterior)
        colours, uncertain = label_colours(changed)
        assert (uncertain == unsure).all()
        assert (colours.max() > 0) == unsure


def test_opposite_motions_have_complementary_colours() -> None:
    angle = np.linspace(0, 2 * np.pi, 13)
    flow = 100 * np.stack([np.cos(angle), np.sin(angle)], axis=1).astype(np.float32)
    forth, back = flow_colours(flow), flow_colours(-flow)
    assert np.allclose(forth + back, (forth + back)[0], atol=6)
    assert np.allclose(flow_colours(np.zeros((1, 2), np.float32)), 255)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("nothing.mp4",), "no such file"),
        (("CLIP", "--out", "seen.mp4"), ".webm"),
        (("CLIP", "--out", "no/such/folder/seen.webm"), "folder does not exist"),
        (("CLIP", "--every", "0"), "every 0 frames"),
        (("CLIP", "--limit", "0"), "--limit"),
    ],
)
def test_bad_input_gives_one_message(
    clip: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
    arguments: tuple[str, ...],
    message: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(monkeypatch, *(clip if w == "CLIP" else w for w in arguments)) == 2
    error = capfd.readouterr().err
    assert message in error
    assert "Traceback" not in error
    assert not list(tmp_path.iterdir())


def test_a_mission_folder_stands_for_its_video(tmp_path: Path, clip: Path) -> None:
    assert video_of(str(tmp_path)) == str(tmp_path)
    (tmp_path / "mission.json").write_text(json.dumps({}))
    (tmp_path / "video.avi").write_bytes(clip.read_bytes())
    assert video_of(str(tmp_path)) == str(tmp_path / "video.avi")

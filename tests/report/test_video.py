"""The annotated video."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.report.scene import FPS, run
from visup.agent.model.errors import OutputError
from visup.percepts.video import open_source
from visup.report.annotate import annotate
from visup.report.video import AnnotatedVideo, WebmWriter, playable_size


@pytest.mark.parametrize("size", [(160, 120), (161, 91), (1400, 100)])
def test_the_annotated_video_can_be_read_back(
    tmp_path: Path, size: tuple[int, int], capfd: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "annotated.webm"
    steps = [pair for _, pair in zip(range(12), run(size), strict=False)]
    with AnnotatedVideo(path, FPS) as video:
        for step, frame in steps:
            video.add(step, frame)
    with open_source(str(path)) as source:
        frames = list(source)
    assert source.ended == "complete"
    assert (len(frames), source.fps, source.size) == (12, FPS, playable_size(*size))
    assert capfd.readouterr().err == ""


def test_the_video_shows_the_annotation(tmp_path: Path) -> None:
    path = tmp_path / "annotated.webm"
    steps = [pair for _, pair in zip(range(5), run((320, 240)), strict=False)]
    with AnnotatedVideo(path, FPS) as video:
        for step, frame in steps:
            video.add(step, frame)
    with open_source(str(path)) as source:
        shown = [f.image.astype(int) for f in source]
    for image, (step, frame) in zip(shown, steps, strict=True):
        wanted = annotate(frame.image, step.mind).astype(int)
        assert np.abs(image - wanted).mean() < np.abs(image - frame.image).mean()


def test_without_a_frame_there_is_no_file(tmp_path: Path) -> None:
    WebmWriter(tmp_path / "a.webm", 25.0).close()
    assert list(tmp_path.iterdir()) == []


def test_an_unwritable_path_is_reported(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    writer = WebmWriter(tmp_path / "missing" / "a.webm", 25.0)
    with pytest.raises(OutputError, match="cannot be written"):
        writer.write(np.zeros((48, 64, 3), np.uint8))
    assert capfd.readouterr().err == ""


@given(width=st.integers(1, 8000), height=st.integers(1, 8000))
@settings(max_examples=100, deadline=None)
def test_videos_are_even_and_not_too_wide(width: int, height: int) -> None:
    w, h = playable_size(width, height)
    assert w % 2 == h % 2 == 0
    assert 16 <= w <= 960
    assert h >= 16
    if min(w, h) > 16:
        assert w / h == pytest.approx(width / height, rel=0.12)

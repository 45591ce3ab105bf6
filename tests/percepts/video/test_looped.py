"""A clip that is played over and over is a camera: live, in its own time, without an end."""

from __future__ import annotations

from itertools import islice
from pathlib import Path

import numpy as np
import pytest

from tests.clips import moving_disc, write_clip
from visup.agent.model.errors import SourceError
from visup.percepts.video import open_source
from visup.percepts.video.capture import open_capture
from visup.percepts.video.looped import LoopedCapture
from visup.percepts.video.waiting_clock import WaitingClock


class FakeTime:
    """A clock that goes on when somebody waits, or thinks."""

    def __init__(self) -> None:
        self.now = 100.0
        self.waited: list[float] = []

    def wait(self, seconds: float) -> None:
        self.waited.append(seconds)
        self.now += seconds


@pytest.fixture(scope="module")
def clip(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_clip(tmp_path_factory.mktemp("loop") / "disc.avi", moving_disc(5), fps=10.0)


def test_it_begins_anew_at_its_end(clip: Path) -> None:
    time = FakeTime()
    capture = LoopedCapture(
        str(clip), open_capture, clock=WaitingClock(lambda: time.now, time.wait)
    )
    images = []
    for _ in range(12):
        assert capture.grab()
        images.append(capture.retrieve()[1])
    assert all(np.array_equal(images[i], images[i + 5]) for i in range(7))
    assert not np.array_equal(images[0], images[4])
    capture.release()


def test_frames_come_when_they_are_due_and_at_once_to_who_is_late(clip: Path) -> None:
    time = FakeTime()
    capture = LoopedCapture(
        str(clip), open_capture, clock=WaitingClock(lambda: time.now, time.wait)
    )
    for _ in range(3):
        capture.grab()
    assert time.waited == pytest.approx([0.1, 0.1])
    time.now += 0.25  # somebody thinks
    for _ in range(3):
        capture.grab()
    assert time.waited[2:] == pytest.approx([0.05])
    capture.release()


def test_it_is_opened_like_any_source(clip: Path) -> None:
    with open_source(f"loop:{clip}", fps=500.0, every=2) as source:
        assert source.live
        assert source.frame_count is None
        assert [f.index for f in islice(source, 6)] == [0, 2, 4, 6, 8, 10]


@pytest.mark.parametrize("name", ["loop:", "loop:none.avi", "loop:."])
def test_a_clip_that_is_not_there_is_told(name: str) -> None:
    with pytest.raises(SourceError, match="no such clip"):
        open_source(name)


def test_what_is_no_video_is_told(tmp_path: Path) -> None:
    (tmp_path / "text.avi").write_text("no")
    with pytest.raises(SourceError, match="not a video"):
        open_source(f"loop:{tmp_path / 'text.avi'}")

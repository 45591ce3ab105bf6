"""Cameras and URLs, with captures made for the test and a server on this machine."""

from __future__ import annotations

import functools
import http.server
import itertools
import threading
from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from tests.percepts.video.clips import COUNT, cut, picture, write_video
from visup.agent.model.errors import SourceError
from visup.percepts.video import Ending, open_source
from visup.percepts.video.live_source import LiveSource
from visup.percepts.video.quiet_decoder import quiet


class FakeCapture:
    """Delivers the given images, then nothing."""

    def __init__(self, images: list[NDArray[np.uint8]], fps: float = 0.0) -> None:
        self.images = images
        self.fps = fps
        self.at = -1
        self.released = 0

    def isOpened(self) -> bool:
        return True

    def grab(self) -> bool:
        self.at += 1
        return self.at < len(self.images)

    def retrieve(self) -> tuple[bool, NDArray[np.uint8]]:
        return True, self.images[self.at]

    def get(self, prop: int) -> float:
        return self.fps if prop == cv2.CAP_PROP_FPS else -1.0

    def release(self) -> None:
        self.released += 1


def ticking(step: float) -> Iterator[float]:
    now = 100.0
    while True:
        yield now
        now += step


def test_a_camera_is_timed_by_the_clock_and_its_loss_is_told() -> None:
    capture = FakeCapture([picture(i) for i in range(5)])
    clock = ticking(0.5)
    with LiveSource("camera 0", capture, clock=lambda: next(clock)) as source:
        frames = list(source)
    assert [f.index for f in frames] == list(range(5))
    assert [f.time for f in frames] == pytest.approx([0.0, 0.5, 1.0, 1.5, 2.0])
    assert (source.live, source.frame_count, source.fps) == (True, None, 25.0)
    assert "25 fps is assumed" in source.notes[0]
    assert source.ended is Ending.TRUNCATED
    assert source.problem is not None
    assert "stopped delivering" in source.problem
    assert capture.released == 1


def test_a_clock_that_stands_still_does_not_stop_time() -> None:
    with LiveSource("x", FakeCapture([picture(0)] * 4), clock=lambda: 7.0) as source:
        times = [f.time for f in source]
    assert all(b > a for a, b in itertools.pairwise(times))


def test_every_thins_a_camera() -> None:
    opened: list[str | int] = []

    def factory(name: str | int) -> FakeCapture:
        opened.append(name)
        return FakeCapture([picture(i) for i in range(7)], fps=30.0)

    with open_source("2", every=3, factory=factory) as source:
        assert [f.index for f in source] == [0, 3, 6]
    assert (opened, source.fps, source.name) == ([2], 30.0, "camera 2")


def test_a_camera_left_early_was_stopped() -> None:
    with LiveSource("x", FakeCapture([picture(0)] * 4)) as source:
        next(source)
    assert source.ended is Ending.STOPPED


def test_a_camera_without_a_frame_is_an_error() -> None:
    capture = FakeCapture([])
    with pytest.raises(SourceError, match="delivers no frame"):
        LiveSource("camera 0", capture)
    assert capture.released == 1


def test_a_change_of_size_ends_a_camera() -> None:
    with LiveSource("x", FakeCapture([picture(0), picture(0, (20, 20))])) as source:
        assert len(list(source)) == 1
    assert "image size" in (source.problem or "")


@pytest.mark.parametrize(
    ("source", "message"),
    [
        ("63", "camera cannot be opened"),
        ("http://127.0.0.1:9/none.mp4", "URL cannot be opened"),
        ("rtsp://127.0.0.1:9/none", "URL cannot be opened"),
        ("gopher://127.0.0.1/x", "kind of URL"),
        ("/dev/null", "camera cannot be opened"),
        ("  ", "no source"),
    ],
)
def test_what_cannot_be_reached_is_told_in_one_clear_message(
    source: str, message: str, capfd: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SourceError, match=message):
        open_source(source)
    assert capfd.readouterr() == ("", "")


class SilentHandler(http.server.SimpleHTTPRequestHandler):
    def log_message(self, format: str, *args: object) -> None:
        pass

    def copyfile(self, *args: object) -> None:
        try:
            super().copyfile(*args)  # type: ignore[arg-type]
        except ConnectionError:  # the reader looks at the head and asks again
            return


@pytest.fixture
def server(tmp_path: Path) -> Iterator[str]:
    handler = functools.partial(SilentHandler, directory=str(tmp_path))
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as running:
        threading.Thread(target=running.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{running.server_address[1]}"
        running.shutdown()


def test_a_recording_behind_a_url_is_read_to_its_end(server: str, tmp_path: Path) -> None:
    write_video(tmp_path / "a.avi")
    with open_source(f"{server}/a.avi") as source:
        assert [f.index for f in source] == list(range(COUNT))
    assert (source.live, source.ended) == (False, Ending.COMPLETE)


def test_a_recording_behind_a_url_that_is_cut_is_told(server: str, tmp_path: Path) -> None:
    path = cut(write_video(tmp_path / "a.avi"), 0.5)
    with open_source(f"{server}/{path.name}") as source:
        assert 0 < len(list(source)) < COUNT
    assert source.ended is Ending.TRUNCATED


def test_quiet_gives_standard_error_back(capfd: pytest.CaptureFixture[str]) -> None:
    import os

    with quiet():
        os.write(2, b"native noise")
    os.write(2, b"a word of ours")
    assert capfd.readouterr().err == "a word of ours"

"""The part of OpenCV's capture interface that sources need, opened without log output."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from visup.percepts.opencv_names import opencv_name
from visup.percepts.video.quiet_decoder import hush_decoder, quiet
from visup.percepts.video.source import DEFAULT_FPS, to_bgr

CONNECT_MS = 10_000
HIGHEST_FPS = 1000.0
MAX_FRAMES = 10**8


class Capture(Protocol):
    """The part of `cv2.VideoCapture` in use."""

    def isOpened(self) -> bool:
        """Whether frames can be read."""
        ...

    def grab(self) -> bool:
        """Go to the next frame; False at the end."""
        ...

    def retrieve(self) -> tuple[bool, NDArray[np.generic]]:
        """Decode the grabbed frame."""
        ...

    def get(self, prop: int) -> float:
        """A property by OpenCV's number."""
        ...

    def release(self) -> None:
        """Release the file or camera."""
        ...


CaptureFactory = Callable[[str | int], Capture]
"""Opens what the user named; tests pass their own."""


def open_capture(name: str | int) -> Capture:
    """Open a file, a URL or a camera (by index or device); check `isOpened` afterwards."""
    import cv2

    hush_decoder()
    with quiet():
        if isinstance(name, int) or name.startswith("/dev/"):
            return cv2.VideoCapture(name)
        if "://" not in name:
            return cv2.VideoCapture(opencv_name(name), cv2.CAP_FFMPEG)
        timeouts = (cv2.CAP_PROP_OPEN_TIMEOUT_MSEC, cv2.CAP_PROP_READ_TIMEOUT_MSEC)
        return cv2.VideoCapture(
            name, cv2.CAP_FFMPEG, [v for p in timeouts for v in (p, CONNECT_MS)]
        )


def take(capture: Capture) -> NDArray[np.uint8] | None:
    """The last grabbed frame as (H, W, 3) uint8 BGR, or None if it cannot be decoded."""
    ok, image = capture.retrieve()
    return to_bgr(image) if ok and image is not None and image.size else None


def frame_rate(capture: Capture, wanted: float | None) -> tuple[float, tuple[str, ...]]:
    """Frames per second, and a note if assumed."""
    import cv2

    if wanted is not None:
        return wanted, ()
    fps = float(capture.get(cv2.CAP_PROP_FPS))
    if math.isfinite(fps) and 0.0 < fps <= HIGHEST_FPS:
        return fps, ()
    return DEFAULT_FPS, (f"The source states no frame rate; {DEFAULT_FPS:g} fps is assumed.",)


def announced_frames(capture: Capture) -> int | None:
    """Number of frames according to the container, or None if it does not say."""
    import cv2

    count = float(capture.get(cv2.CAP_PROP_FRAME_COUNT))
    return int(count) if math.isfinite(count) and 0 < count < MAX_FRAMES else None

"""A ring buffer of recent frames as JPEG, limited in seconds and bytes."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.percepts.motion.pausing import cell_means
from visup.report.video import playable_size

QUALITY = 80
MAX_REUSE_S = 0.95
"""How long a frame replaces the following ones that show nothing new, seconds."""

MIN_VISIBLE_CHANGE = 3
"""Difference of the mean of 8 x 8 pixels that counts as visible, grey levels; camera noise causes one or
two."""


@dataclass(frozen=True, slots=True)
class EncodedFrame:
    """An encoded frame.

    Attributes:
        time: Seconds of the source.
        jpeg: The picture.
    """

    time: float
    jpeg: bytes


def encoded(image: NDArray[np.uint8], time: float) -> EncodedFrame:
    """Encode a frame, no wider than the video of a run.

    Args:
        image: (H, W, 3) uint8 BGR.
        time: Seconds of the source.
    """
    size = playable_size(image.shape[1], image.shape[0])
    if size != (image.shape[1], image.shape[0]):
        image = np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), np.uint8)
    return EncodedFrame(time, jpeg_of(image))


def jpeg_of(image: NDArray[np.uint8], quality: int = QUALITY) -> bytes:
    """A picture as JPEG.

    Args:
        image: (H, W, 3) uint8 BGR.
        quality: 0 to 100.
    """
    _, data = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, quality])
    return data.tobytes()


class FrameEncoder:
    """Encodes the frames of a camera; one that shows nothing new reuses the previous encoding.

    Most cameras see no change for most of the day. Changes below the noise are encoded about once a second.
    """

    def __init__(self) -> None:
        self._last: EncodedFrame | None = None
        self._since = 0.0
        self._small: NDArray[np.uint8] | None = None

    def __call__(self, image: NDArray[np.uint8], time: float) -> EncodedFrame:
        """Encode a frame.

        Args:
            image: (H, W, 3) uint8 BGR.
            time: Seconds of the source.
        """
        small = cell_means(image)
        recent = 0.0 <= time - self._since < MAX_REUSE_S
        if self._last and recent and self._small is not None and _look_the_same(self._small, small):
            self._last = EncodedFrame(time, self._last.jpeg)
        else:
            self._last, self._since, self._small = encoded(image, time), time, small
        return self._last


def _look_the_same(a: NDArray[np.uint8], b: NDArray[np.uint8]) -> bool:
    return a.shape == b.shape and int(cv2.absdiff(a, b).max()) < MIN_VISIBLE_CHANGE


class FrameRing:
    """The last frames, oldest first.

    Args:
        span_s: How long a frame is kept, seconds of the source.
        max_bytes: Limit of their total size; beyond it the oldest are dropped earlier.

    Attributes:
        size: Present total size, bytes.
    """

    def __init__(self, span_s: float, max_bytes: int) -> None:
        self.size = 0
        self._span_s, self._max_bytes = span_s, max_bytes
        self._frames: deque[EncodedFrame] = deque()

    def add(self, frame: EncodedFrame) -> None:
        """Add a frame; drop those that are too old or exceed the limit."""
        self._frames.append(frame)
        self.size += len(frame.jpeg)
        while self._frames and (
            self.size > self._max_bytes or frame.time - self._frames[0].time > self._span_s
        ):
            self.size -= len(self._frames.popleft().jpeg)

    def __iter__(self) -> Iterator[EncodedFrame]:
        """Oldest first."""
        return iter(self._frames)

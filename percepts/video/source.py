"""What a video source is: frames in order, and an honest word on how they ended."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from enum import StrEnum
from types import TracebackType
from typing import Self

import numpy as np
from numpy.typing import NDArray

from visup.agent import Frame

DEFAULT_FPS = 25.0


class Ending(StrEnum):
    """How a source ended."""

    COMPLETE = "complete"
    TRUNCATED = "truncated"
    STOPPED = "stopped"


class VideoSource(ABC, Iterator[Frame]):
    """Frames in order, read once; close it, or use it in a `with` statement.

    Opening a source reads its first frame, so that what cannot be read fails at once. Every image
    is (H, W, 3) uint8 BGR, whatever was stored, and all have the same size.

    Attributes:
        name: What the user named.
        fps: Frames per second of the source itself, before `every`.
        size: (width, height) pixels.
        frame_count: Frames of the source before `every`, or None when unknown; for video files it
            is what the container announces, which may be a little off.
        live: Whether frames are made while they are read; so for a whole kind of source.
        notes: Sentences about what had to be assumed.
        ended: How it ended, or None while frames may still come.
        problem: Why it is truncated, one sentence, or None.
        span: Numbers of the first frame that is given, and of the first that no longer is; None for no end.

    Args:
        name: What the user named.
        fps: Frames per second.
        size: (width, height) pixels.
        frame_count: Frames, or None when unknown.
        every: Only every n-th frame is given.
        notes: Sentences about what had to be assumed.
    """

    live = False
    span: tuple[int, int | None] = (0, None)

    def __init__(
        self,
        name: str,
        *,
        fps: float,
        size: tuple[int, int],
        frame_count: int | None,
        every: int = 1,
        notes: tuple[str, ...] = (),
    ) -> None:
        self.name = name
        self.fps = fps
        self.size = size
        self.frame_count = frame_count
        self.every = every
        self.notes = notes
        self.ended: Ending | None = None
        self.problem: str | None = None

    def __next__(self) -> Frame:
        frame = None if self.ended else self._next()
        while frame is not None and frame.index < self.span[0]:
            frame = self._next()
        if frame is None:
            self._end(Ending.COMPLETE)
            raise StopIteration
        if self.span[1] is not None and frame.index >= self.span[1]:
            self._end(Ending.STOPPED)
            raise StopIteration
        return frame

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """Let go of the file or camera; a source closed before its end has been stopped."""
        self._end(Ending.STOPPED)

    def abandon(self) -> None:
        """Count it as stopped without letting go of it: a thread that cannot be stopped is in it."""
        self.ended = self.ended or Ending.STOPPED

    def _end(self, how: Ending, problem: str | None = None) -> None:
        """Note how it ended, the first time, and let go of what is held."""
        if self.ended is None:
            self.ended, self.problem = how, problem
            self._release()

    @abstractmethod
    def _next(self) -> Frame | None:
        """The next frame that is wanted; None at the end (after `_end` if it is not complete)."""

    @abstractmethod
    def _release(self) -> None:
        """Let go of the file or camera."""


def to_bgr(image: NDArray[np.generic]) -> NDArray[np.uint8]:
    """Turn an image of any common kind into the one kind that visup works on.

    16-bit values are scaled by their full range, floats are taken as 0 to 1, and what is
    transparent becomes black.

    Args:
        image: (H, W) or (H, W, C) with C 1 (grey), 3 (BGR) or 4 (BGR and alpha); bool, any
            integer or float.

    Returns:
        (H, W, 3) uint8 BGR, C-contiguous.

    Raises:
        ValueError: It has another shape.
    """
    if image.ndim == 2:
        image = image[:, :, None]
    if image.ndim != 3 or image.shape[2] not in (1, 3, 4) or 0 in image.shape:
        raise ValueError(f"an image of shape {image.shape}")
    values = _to_uint8(image)
    if values.shape[2] == 4:
        colour = values[:, :, :3].astype(np.uint16) * values[:, :, 3:]
        values = ((colour + 127) // 255).astype(np.uint8)
    if values.shape[2] == 1:
        values = np.repeat(values, 3, axis=2)
    return np.ascontiguousarray(values)


def _to_uint8(image: NDArray[np.generic]) -> NDArray[np.uint8]:
    """The same image in 8 bits, its full range kept."""
    if image.dtype == np.uint8:
        return image.astype(np.uint8, copy=False)
    if image.dtype == np.bool_:
        top = 1.0
    elif np.issubdtype(image.dtype, np.integer):
        top = float(np.iinfo(image.dtype).max)  # type: ignore[type-var]
    else:
        top = 1.0
    shares = np.nan_to_num(image.astype(np.float64) / top, nan=0.0)
    return np.round(np.clip(shares, 0.0, 1.0) * 255.0).astype(np.uint8)

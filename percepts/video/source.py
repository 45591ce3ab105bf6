"""The interface of video sources: frames in order, and how they ended."""

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

    Opening a source reads its first frame, so that unreadable sources fail at once. Every image is
    (H, W, 3) uint8 BGR, whatever was stored, and all have the same size.

    Attributes:
        name: The user's name for it.
        fps: Frames per second of the source itself, before `every`.
        size: (width, height) pixels.
        frame_count: Frames of the source before `every`, or None when unknown; for video files the
            container's count, which may be slightly off.
        live: Whether frames are produced while they are read; fixed per class.
        notes: Sentences about assumptions made.
        ended: How it ended, or None while frames may still come.
        problem: Why it is truncated, one sentence, or None.
        span: Number of the first frame returned, and of the first beyond the end; None for no end.

    Args:
        name: The user's name for it.
        fps: Frames per second.
        size: (width, height) pixels.
        frame_count: Frames, or None when unknown.
        every: Only every n-th frame is returned.
        notes: Sentences about assumptions made.
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
        """Release the file or camera; a source closed before its end counts as stopped."""
        self._end(Ending.STOPPED)

    def abandon(self) -> None:
        """Mark it as stopped without releasing it: a thread that cannot be stopped is using it."""
        self.ended = self.ended or Ending.STOPPED

    def _end(self, how: Ending, problem: str | None = None) -> None:
        """Record how it ended, the first time, and release it."""
        if self.ended is None:
            self.ended, self.problem = how, problem
            self._release()

    @abstractmethod
    def _next(self) -> Frame | None:
        """The next wanted frame; None at the end (after `_end` if incomplete)."""

    @abstractmethod
    def _release(self) -> None:
        """Release the file or camera."""


def to_bgr(image: NDArray[np.generic]) -> NDArray[np.uint8]:
    """Convert an image of any common type to the one type that visup uses.

    16-bit values are scaled by their full range, floats are assumed 0 to 1, and transparent parts become
    black.

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
    """The image in 8 bits, with its full range."""
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

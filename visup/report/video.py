"""The annotated video of a run in a format that browsers play."""

from __future__ import annotations

from pathlib import Path
from types import TracebackType
from typing import Self

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.agent import Frame
from visup.agent.model.errors import OutputError
from visup.agent.model.step import Step
from visup.percepts.opencv_names import opencv_name
from visup.percepts.video.quiet_decoder import quiet
from visup.report.annotate import annotate

MAX_WIDTH = 960
FOURCC = "VP80"


class WebmWriter:
    """Writes pictures as WebM with VP8, which every browser plays.

    The first picture fixes the size; the file appears with it.

    Args:
        path: The file to write, `.webm`.
        fps: Frames per second to play, more than 0.
        max_width: Wider pictures are reduced to it, pixels.
    """

    def __init__(self, path: Path, fps: float, max_width: int = MAX_WIDTH) -> None:
        self.path = path
        self.fps = fps
        self._max_width = max_width
        self._size: tuple[int, int] | None = None
        self._writer: cv2.VideoWriter | None = None

    def write(self, image: NDArray[np.uint8]) -> None:
        """Write one picture; it is resized to the size of the first.

        Args:
            image: (H, W, 3) uint8 BGR.

        Raises:
            OutputError: The file cannot be written.
        """
        if self._writer is None:
            self._size = playable_size(image.shape[1], image.shape[0], self._max_width)
            self._writer = self._opened(self._size)
        if self._size is not None and (image.shape[1], image.shape[0]) != self._size:
            image = np.asarray(
                cv2.resize(image, self._size, interpolation=cv2.INTER_AREA), np.uint8
            )
        self._writer.write(image)

    def close(self) -> None:
        """Finish the file; without a frame none is created."""
        if self._writer is not None:
            self._writer.release()
            self._writer = None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def _opened(self, size: tuple[int, int]) -> cv2.VideoWriter:
        # FFmpeg chooses the container's tag itself and warns on standard error.
        with quiet():
            code = cv2.VideoWriter.fourcc(*FOURCC)
            writer = cv2.VideoWriter(opencv_name(self.path), cv2.CAP_FFMPEG, code, self.fps, size)
        if not writer.isOpened():
            raise OutputError(
                "the annotated video cannot be written",
                where=str(self.path),
                expected="a folder that exists and is writable, and an OpenCV with FFmpeg and VP8",
                hint="run `visup doctor` to see what is installed",
            )
        return writer


class AnnotatedVideo(WebmWriter):
    """Writes each frame with the beliefs drawn over it. Add its `add` to an agent as an observer.

    Args:
        path: The file to write, `.webm`.
        fps: Frames per second to play: those of the source divided by `every`.
    """

    def add(self, step: Step, frame: Frame) -> None:
        """Write one annotated frame.

        Raises:
            OutputError: The file cannot be written.
        """
        self.write(annotate(frame.image, step.mind))


def playable_size(width: int, height: int, max_width: int = MAX_WIDTH) -> tuple[int, int]:
    """The size of the video: limited width, same aspect ratio, sides even and at least 16.

    Args:
        width: Width of the frames, pixels.
        height: Height of the frames, pixels.
        max_width: Maximum width, pixels.

    Returns:
        (width, height), pixels.
    """
    scale = min(1.0, max_width / width)
    return max(16, round(width * scale / 2) * 2), max(16, round(height * scale / 2) * 2)

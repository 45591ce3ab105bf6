"""The folder of a clip: the video, its masks, and other files."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.agent.model.errors import OutputError, SettingsError
from visup.percepts.opencv_names import opencv_name

CODECS = {".mp4": "mp4v", ".avi": "MJPG", ".webm": "VP90"}
"""Container -> codec that OpenCV supports on all platforms."""


class ClipWriter:
    """A video file that grows frame by frame; a context manager.

    Args:
        path: Its suffix chooses the container, one of `CODECS`.
        fps: Frames per second.
        size: (width, height).

    Raises:
        SettingsError: No such container.
        OutputError: The file cannot be written.
    """

    def __init__(self, path: Path, fps: float, size: tuple[int, int]) -> None:
        check_container(path.suffix)
        code = cv2.VideoWriter_fourcc(*CODECS[path.suffix])  # type: ignore[attr-defined]
        self._path = path
        self._writer = cv2.VideoWriter(opencv_name(path), code, fps, size)
        if not self._writer.isOpened():
            raise OutputError("the video cannot be written", where=str(path))

    def __enter__(self) -> ClipWriter:
        return self

    def __exit__(self, *_: object) -> None:
        self._writer.release()

    def write(self, image: NDArray[np.uint8]) -> None:
        """Add one frame, (H, W, 3) uint8, BGR."""
        self._writer.write(image)


def check_container(suffix: str) -> None:
    """Refuse a suffix that is none of `CODECS`."""
    if suffix not in CODECS:
        raise SettingsError(
            f"there is no video container {suffix!r}", expected=", ".join(sorted(CODECS))
        )


def make_clip_folder(out: Path) -> None:
    """Make a new or empty folder with one for masks; masks of another clip would be mistaken for its own.

    Raises:
        OutputError: It cannot be made, or is not empty.
    """
    try:
        out.mkdir(parents=True, exist_ok=True)
        if any(out.iterdir()):
            raise OutputError(
                "the folder is not empty", where=str(out), expected="a new or an empty folder"
            )
        (out / "masks").mkdir()
    except OSError as error:
        raise OutputError(f"the folder cannot be made: {error.strerror}", where=str(out)) from error


def write_mask(out: Path, index: int, mask: NDArray[np.uint8]) -> None:
    """Write the mask of one frame, (H, W) uint8, as ``masks/00000.png`` and so on.

    Raises:
        OutputError: It cannot be written.
    """
    path = out / "masks" / f"{index:05d}.png"
    ok, data = cv2.imencode(".png", mask)
    if not ok:
        raise OutputError("the mask cannot be encoded", where=str(path))
    write_file(path, data.tobytes())


def write_file(path: Path, data: bytes) -> None:
    """Write a file.

    Raises:
        OutputError: It cannot be written.
    """
    try:
        path.write_bytes(data)
    except OSError as error:
        raise OutputError(
            f"the file cannot be written: {error.strerror}", where=str(path)
        ) from error

"""A clip in progress: frames are appended to a file, which survives a kill, and then encoded as WebM.

The video is encoded after its last frame with VP8, which every browser plays and which OpenCV's FFmpeg
supports without the licence obligations of H.264. (The binary packages of PyAV include x264 and x265, which
are under the GPL.)
"""

from __future__ import annotations

import shutil
import struct
from collections.abc import Iterable, Iterator
from pathlib import Path

import cv2
import numpy as np

from visup.agent.model.errors import OutputError
from visup.report.video import WebmWriter
from visup.runs.evidence.frame_ring import EncodedFrame

SUFFIX = ".spool"
_HEAD = struct.Struct("<dI")
MAX_FRAME_BYTES = 2**26
MAX_FPS, MIN_FPS = 30.0, 1.0
"""Limits of the frame rate of a clip, frames per second."""

MIN_FREE_BYTES = 2**24
"""Bytes that must be free on the disk before and after: the encoder does not report a full disk."""


class ClipSpool:
    """Frames of one clip, appended to a file.

    Args:
        path: The file, which does not exist yet.

    Raises:
        OSError: It cannot be written.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._file = path.open("xb")

    def add(self, frame: EncodedFrame) -> None:
        """Append a frame.

        Raises:
            OSError: It cannot be written.
        """
        self._file.write(_HEAD.pack(frame.time, len(frame.jpeg)) + frame.jpeg)
        self._file.flush()

    def close(self) -> None:
        """Close the file."""
        self._file.close()


def spooled(path: Path) -> Iterator[EncodedFrame]:
    """The frames of a spool up to the first incomplete one."""
    with path.open("rb") as file:
        while len(head := file.read(_HEAD.size)) == _HEAD.size:
            time, size = _HEAD.unpack(head)
            if size > MAX_FRAME_BYTES or len(jpeg := file.read(size)) < size:
                return
            yield EncodedFrame(time, jpeg)


def encode_clip(spool: Path, target: Path, fps: float) -> None:
    """Encode the video of a spool, and delete the spool.

    Args:
        spool: Frames with their times.
        target: The `.webm` file, written atomically.
        fps: Processed frames per second of the source.

    Raises:
        OutputError: There is not enough space; the spool stays.
        OSError: A file cannot be read or written.
    """
    fps = min(MAX_FPS, max(MIN_FPS, fps))
    draft = target.with_name(f".{target.stem}.part.webm")
    try:
        _check_free_space(target.parent)
        with WebmWriter(draft, fps) as video:
            for frame in at_constant_rate(spooled(spool), fps):
                image = cv2.imdecode(np.frombuffer(frame.jpeg, np.uint8), cv2.IMREAD_COLOR)
                if image is not None:
                    video.write(np.asarray(image, np.uint8))
        _check_free_space(target.parent)
        if draft.exists():  # a spool without a complete frame makes no video
            draft.replace(target)
    finally:
        draft.unlink(missing_ok=True)
    spool.unlink(missing_ok=True)


def at_constant_rate(frames: Iterable[EncodedFrame], fps: float) -> Iterator[EncodedFrame]:
    """Resample frames to a constant rate: at each tick the latest frame.

    >>> frames = [EncodedFrame(t, b"") for t in (0.0, 0.1, 1.0)]
    >>> [frame.time for frame in at_constant_rate(frames, 4.0)]
    [0.0, 0.1, 0.1, 0.1, 1.0]
    """
    start: float | None = None
    emitted, last = 0, None
    for frame in frames:
        start = frame.time if start is None else start
        while last is not None and start + emitted / fps < frame.time - 1e-6:
            yield last
            emitted += 1
        last = frame
    if last is not None:
        yield last


def _check_free_space(folder: Path) -> None:
    if shutil.disk_usage(folder).free < MIN_FREE_BYTES:
        raise OutputError("the disk has no room for a clip", where=str(folder))

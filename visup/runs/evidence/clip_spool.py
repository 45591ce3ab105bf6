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
LARGEST_FRAME = 2**26
FASTEST, SLOWEST = 30.0, 1.0
"""Limits of the frame rate of a clip, frames per second."""

LEAST_FREE = 2**24
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
            if size > LARGEST_FRAME or len(jpeg := file.read(size)) < size:
                return
            yield EncodedFrame(time, jpeg)


def write_clip_of(spool: Path, target: Path, fps: float) -> None:
    """Encode the video of a spool, and delete the spool.

    Args:
        spool: Frames with their times.
        target: The `.webm` file, written atomically.
        fps: Processed frames per second of the source.

    Raises:
        OutputError: There is not enough space; the spool stays.
        OSError: A file cannot be read or written.
    """
    fps = min(FASTEST, max(SLOWEST, fps))
    draft = target.with_name(f".{target.stem}.part.webm")
    try:
        _check_room(target.parent)
        with WebmWriter(draft, fps) as video:
            for frame in evenly(spooled(spool), fps):
                image = cv2.imdecode(np.frombuffer(frame.jpeg, np.uint8), cv2.IMREAD_COLOR)
                if image is not None:
                    video.write(np.asarray(image, np.uint8))
        _check_room(target.parent)
        if draft.exists():  # a spool without a complete frame makes no video
            draft.replace(target)
    finally:
        draft.unlink(missing_ok=True)
    spool.unlink(missing_ok=True)


def evenly(frames: Iterable[EncodedFrame], fps: float) -> Iterator[EncodedFrame]:
    """Resample frames to a constant rate: at each tick the latest frame.

    >>> frames = [EncodedFrame(t, b"") for t in (0.0, 0.1, 1.0)]
    >>> [frame.time for frame in evenly(frames, 4.0)]
    [0.0, 0.1, 0.1, 0.1, 1.0]
    """
    begin: float | None = None
    shown, last = 0, None
    for frame in frames:
        begin = frame.time if begin is None else begin
        while last is not None and begin + shown / fps < frame.time - 1e-6:
            yield last
            shown += 1
        last = frame
    if last is not None:
        yield last


def _check_room(folder: Path) -> None:
    if shutil.disk_usage(folder).free < LEAST_FREE:
        raise OutputError("the disk has no room for a clip", where=str(folder))

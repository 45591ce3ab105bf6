"""A clip while it is made: frames one after the other in a file, whole again after a kill, then WebM.

The video is written once its last frame is there, with VP8, which every browser plays: OpenCV's FFmpeg writes
it without H.264, whose licence would bind whoever ships it. (The ready-made PyAV has x264 and x265 in it,
which are under the GPL.)
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
"""Frames a second of a clip."""

LEAST_FREE = 2**24
"""Bytes that must be free on the disk before and after: an encoder does not say that it found no room."""


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
        """No more frames."""
        self._file.close()


def spooled(path: Path) -> Iterator[EncodedFrame]:
    """The frames of a spool, up to the first that was not written whole."""
    with path.open("rb") as file:
        while len(head := file.read(_HEAD.size)) == _HEAD.size:
            time, size = _HEAD.unpack(head)
            if size > LARGEST_FRAME or len(jpeg := file.read(size)) < size:
                return
            yield EncodedFrame(time, jpeg)


def write_clip_of(spool: Path, target: Path, fps: float) -> None:
    """Make the video of a spool, which is deleted then.

    Args:
        spool: Frames with their times.
        target: The file to write, `.webm`; it appears whole or not at all.
        fps: Frames a second at which the source was looked at.

    Raises:
        OutputError: There is no room for it; the spool stays.
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
        if draft.exists():  # a spool without a whole frame makes no video
            draft.replace(target)
    finally:
        draft.unlink(missing_ok=True)
    spool.unlink(missing_ok=True)


def evenly(frames: Iterable[EncodedFrame], fps: float) -> Iterator[EncodedFrame]:
    """Frames as a video of one rate shows them: at each of its moments the latest one, as long as it takes.

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

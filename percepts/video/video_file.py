"""Video files, and recordings behind URLs, read to their end."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from visup.agent import Frame
from visup.agent.model.errors import SourceError
from visup.percepts.image_size import check_pixels
from visup.percepts.video.capture import (
    Capture,
    CaptureFactory,
    announced_frames,
    frame_rate,
    open_capture,
    take,
)
from visup.percepts.video.source import Ending, VideoSource

SNIFFED_BYTES = 4096
ROUNDING_S = 0.002
MIN_STEP = 0.1
"""Least time between two frames, in usual intervals: velocities between moments that are equal up to rounding
would be unbounded."""
STILL_IMAGE = "it is a single image, not a video"
TEXT = "it is a text file, not a video"


@dataclass(slots=True)
class ContainerClock:
    """Times of the frames of a container, in seconds since its first frame.

    Containers round their times (WebM to a millisecond), so where they agree with a constant rate the exact
    quotient is used. Where they differ the rate varies and the container is right. A container that goes
    back in time, or stands still, is wrong, and the rate continues from the last valid time.

    Attributes:
        fps: Frames per second, above 0.
        constant: Whether the user gave the rate, so that the container's times are ignored.
    """

    fps: float
    constant: bool = False
    _first: float | None = field(default=None, init=False)
    _last: float = field(default=-1.0, init=False)

    def time(self, index: int, container_s: float) -> float:
        """Time of a frame; call it for each frame in order.

        Args:
            index: Number of the frame, from 0.
            container_s: The container's time, seconds from any start.

        Returns:
            Seconds, later than the previous frame by at least a tenth of the usual interval.
        """
        if self._first is None:
            self._first = container_s if np.isfinite(container_s) else 0.0
        even, time_s = index / self.fps, container_s - self._first
        if self.constant or abs(time_s - even) <= ROUNDING_S:
            time_s = even
        least = self._last + MIN_STEP / self.fps if index else self._last
        if not (np.isfinite(time_s) and time_s > least):
            time_s = self._last + 1.0 / self.fps if index else 0.0
        self._last = time_s
        return time_s


def check_frame_size(name: str, capture: Capture) -> None:
    """Reject a video whose frames are too large, before decoding the first.

    Raises:
        SourceError: They are too large.
    """
    import cv2

    try:
        check_pixels(capture.get(cv2.CAP_PROP_FRAME_WIDTH), capture.get(cv2.CAP_PROP_FRAME_HEIGHT))
    except ValueError as fault:
        capture.release()
        raise SourceError(f"a frame of the video {fault}", where=name) from fault


class VideoFile(VideoSource):
    """A recording: its frames, their times, and whether all announced frames were there.

    Args:
        name: The user's name for it.
        capture: An open capture.
        every: Only every n-th frame is returned.
        fps: Frame rate that the user gave, or None to use the container's times.

    Raises:
        SourceError: No frame can be decoded.
    """

    def __init__(
        self, name: str, capture: Capture, *, every: int = 1, fps: float | None = None
    ) -> None:
        rate, notes = frame_rate(capture, fps)
        self._capture = capture
        self._clock = ContainerClock(rate, constant=fps is not None)
        self._read = 0
        self._last_time = 0.0
        self._grabbed_index = -1
        check_frame_size(name, capture)
        first = self._advance(every=1)
        if first is None:
            capture.release()
            raise SourceError(
                "the video has no frame that can be decoded",
                where=name,
                expected="at least one frame",
                hint="check that it plays elsewhere; it may be damaged or use an unknown codec",
            )
        self._waiting: Frame | None = first
        super().__init__(
            name,
            fps=rate,
            size=first.size,
            frame_count=announced_frames(capture),
            every=every,
            notes=notes,
        )

    def _next(self) -> Frame | None:
        frame, self._waiting = self._waiting, None
        if frame is None:
            frame = self._advance(self.every)
        if frame is None:
            self._end_of_file()
        elif frame.size != self.size:
            self._end(Ending.TRUNCATED, _changed(frame, self.size))
            return None
        return frame

    def _advance(self, every: int) -> Frame | None:
        """Grab up to the next wanted frame; frames in between are not converted."""
        import cv2

        while self._capture.grab():
            index, self._read = self._read, self._read + 1
            container_s = self._capture.get(cv2.CAP_PROP_POS_MSEC) / 1000.0
            self._last_time = self._clock.time(index, container_s)
            if index % every or (index and index < self.span[0]):
                continue
            image = take(self._capture)
            if image is not None:
                return Frame(index, self._last_time, image)
        return None

    def _end_of_file(self) -> None:
        if not falls_short(self._read, self._last_time, self.frame_count, self.fps):
            self._end(Ending.COMPLETE)
            return
        self._end(
            Ending.TRUNCATED,
            f"{self.name} is cut off or damaged: {self._read} of the {self.frame_count} frames "
            f"that it announces could be decoded, up to {self._last_time:.2f} s.",
        )

    def _release(self) -> None:
        self._capture.release()


def falls_short(read: int, last_time: float, announced: int | None, fps: float) -> bool:
    """Whether a video ended before its announced end, beyond the usual error of containers.

    Announced counts are often estimated from duration and rate, so both the count and the time must fall
    short: a video of variable rate holds fewer frames than announced, but its full duration.

    Args:
        read: Frames that could be decoded.
        last_time: Time of the last one, seconds.
        announced: Frames according to the container, or None when it does not say.
        fps: Frames per second.

    Returns:
        True when frames are missing; False when none are, or when nothing was announced.
    """
    if announced is None:
        return False
    least = announced - max(2.0, min(0.01 * announced, fps))
    return read < least and last_time * fps + 1.0 < least


def _changed(frame: Frame, size: tuple[int, int]) -> str:
    return (
        f"The image size changes from {size[0]}x{size[1]} to {frame.size[0]}x{frame.size[1]} "
        f"at frame {frame.index}; what came before is kept."
    )


def open_file(
    path: Path,
    *,
    every: int = 1,
    fps: float | None = None,
    factory: CaptureFactory = open_capture,
) -> VideoFile:
    """Open a video file.

    Args:
        path: The file; it exists.
        every: Only every n-th frame is returned.
        fps: Frame rate to assume, or None for the container's own times.
        factory: Opens the capture.

    Returns:
        The source, its first frame decoded.

    Raises:
        SourceError: It cannot be read, is empty, is text or an image, or is not a video.
    """
    head = _head(path)
    kind = _not_a_video(head)
    if kind:
        raise _unfit(path, kind)
    capture = factory(str(path))
    if not capture.isOpened():
        raise _unfit(path, "it is not a video that can be read, or its header is damaged")
    return VideoFile(str(path), capture, every=every, fps=fps)


def _head(path: Path) -> bytes:
    """The first bytes of a file, or the reason why there are none."""
    try:
        with path.open("rb") as file:
            head = file.read(SNIFFED_BYTES)
    except PermissionError as e:
        raise SourceError(
            "permission to read it is denied", where=str(path), hint="check the file's permissions"
        ) from e
    except OSError as e:
        raise SourceError(f"it cannot be read ({e.strerror or e})", where=str(path)) from e
    if not head:
        raise SourceError(
            "the file is empty",
            where=str(path),
            expected="a video",
            hint="copy or record it again; nothing was written to it",
        )
    return head


def _not_a_video(head: bytes) -> str | None:
    """The actual type of a file that is no video, by its first bytes."""
    if head.startswith((b"\xff\xd8\xff", b"\x89PNG\r\n\x1a\n", b"BM", b"II*\0", b"MM\0*")):
        return STILL_IMAGE
    return TEXT if _is_text(head) else None


def _is_text(head: bytes) -> bool:
    """Whether bytes are text: FFmpeg would play a text file as a slide show of letters."""
    if any(b < 32 and b not in b"\t\n\r\f\x1b" for b in head):
        return False
    try:
        head[: head.rfind(b"\n") + 1 or len(head)].decode("utf-8")
    except UnicodeDecodeError:
        return False
    return True


def _unfit(path: Path, what: str) -> SourceError:
    hints = {
        STILL_IMAGE: f"to read a folder of images, name the folder: {path.parent}",
        TEXT: "name the video itself; this file may be its description or its list of parts",
    }
    usual = "check that it plays in a video player; if it is still being written, wait for its end"
    return SourceError(
        what,
        where=str(path),
        expected="a video such as .mp4, .avi, .webm, .mkv or .mov",
        hint=hints.get(what, usual),
    )

"""Opening of a source of frames from what the user named."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from pathlib import Path

from visup.agent.model.did_you_mean import closest_file
from visup.agent.model.errors import SettingsError, SourceError
from visup.percepts.video.capture import (
    Capture,
    CaptureFactory,
    announced_frames,
    open_capture,
)
from visup.percepts.video.image_folder import open_folder
from visup.percepts.video.live_source import LiveSource, Reconnection
from visup.percepts.video.looped import LOOP, LoopedCapture
from visup.percepts.video.ros_bag import is_bag, open_bag
from visup.percepts.video.source import VideoSource
from visup.percepts.video.video_file import VideoFile, open_file
from visup.redaction import redacted

URL = re.compile(r"^[a-z][a-z0-9+.-]+://", re.IGNORECASE)
SCHEMES = ("rtsp", "rtsps", "rtmp", "http", "https", "udp", "tcp", "srt")


def open_source(
    source: str,
    *,
    every: int = 1,
    fps: float | None = None,
    factory: CaptureFactory = open_capture,
    patience_s: float = 0.0,
) -> VideoSource:
    """Open a source of frames.

    Args:
        source: A video file, a folder of images (or a MOT or DAVIS sequence folder), the index of
            a camera such as '0', a URL (rtsp, http, ...), a ROS 2 bag (`bag` or `bag#/topic`), or
            `loop:CLIP`, a video file played in a loop as if from a camera.
        every: Return only every n-th frame; frames keep their number and time in the source.
        fps: Frames per second to assume in place of the source's own.
        factory: Opens files, cameras and URLs.
        patience_s: How long to retry a camera or stream that drops, seconds.

    Returns:
        The source, its first frame decoded. Use it in a `with` statement.

    Raises:
        SourceError: It is missing, empty, unreadable, or not a video.
        SettingsError: `every` is below 1 or `fps` is not a positive number.
    """
    _check(every, fps)
    if not source.strip():
        raise SourceError("no source was named", hint="name a video file or a folder of images")
    opening = _Opening(every, fps, factory, patience_s)
    if source.isdecimal():
        camera = _camera(int(source), factory)
        return opening.live(f"camera {source}", camera, int(source))
    if URL.match(source):
        return _open_url(source, opening)
    if source.startswith(LOOP):
        return _open_loop(source, opening)
    return _open_path(Path(source).expanduser(), opening)


@dataclass(frozen=True, slots=True)
class _Opening:
    """Options for opening a source; fields as the arguments of `open_source`."""

    every: int
    fps: float | None
    factory: CaptureFactory
    patience_s: float

    def live(self, name: str, capture: Capture, opened: str | int) -> LiveSource:
        """A live source of an open capture, reopened when it drops."""
        reconnection = Reconnection(lambda: self.factory(opened), self.patience_s)
        return LiveSource(name, capture, every=self.every, fps=self.fps, reconnection=reconnection)


def _check(every: int, fps: float | None) -> None:
    if every < 1:
        raise SettingsError(f"every {every} frames is not possible", expected="1 or more")
    if fps is not None and not (math.isfinite(fps) and fps > 0):
        raise SettingsError(f"{fps} frames per second are not possible", expected="more than 0")


def _camera(camera: int | str, factory: CaptureFactory) -> Capture:
    capture = factory(camera)
    if not capture.isOpened():
        raise SourceError(
            "the camera cannot be opened",
            where=f"camera {camera}" if isinstance(camera, int) else camera,
            expected="a camera that is connected and free",
            hint=f"to read a file or folder named {camera}, write ./{camera}"
            if isinstance(camera, int)
            else None,
        )
    return capture


def _open_url(url: str, opening: _Opening) -> VideoFile | LiveSource:
    """A recording when the stream knows its number of frames, else a live source.

    It is named by its address without credentials, since names appear in every record.
    """
    shown = redacted(url)
    if url.split(":", 1)[0].lower() not in SCHEMES:
        raise SourceError(
            "this kind of URL cannot be read", where=shown, expected=f"one of {', '.join(SCHEMES)}"
        )
    capture = opening.factory(url)
    if not capture.isOpened():
        raise SourceError(
            "the URL cannot be opened, or what it gives is not a video",
            where=shown,
            expected="an address that delivers video",
            hint="check the address and the network",
        )
    if announced_frames(capture):
        return VideoFile(shown, capture, every=opening.every, fps=opening.fps)
    return opening.live(shown, capture, url)


def _open_loop(source: str, opening: _Opening) -> LiveSource:
    path = Path(source.removeprefix(LOOP)).expanduser()
    if not path.is_file():
        raise SourceError(
            "there is no such clip to loop",
            where=source,
            expected=f"{LOOP}CLIP, a video file",
            hint=_nearest(path),
        )
    clip = LoopedCapture(str(path), opening.factory, opening.fps)
    if not clip.isOpened():
        raise SourceError("this is not a video that can be read", where=source)
    return LiveSource(source, clip, every=opening.every, fps=opening.fps)


def _open_path(path: Path, opening: _Opening) -> VideoSource:
    try:
        bag = _bag(path)
        if bag:
            return open_bag(*bag, every=opening.every, fps=opening.fps)
        if path.is_dir():
            return open_folder(path, every=opening.every, fps=opening.fps)
        if path.is_char_device():
            return opening.live(str(path), _camera(str(path), opening.factory), str(path))
        regular, exists = path.is_file(), path.exists()
    except (OSError, ValueError) as e:  # the name is too long or contains NUL
        raise SourceError("this is not a usable file name", where=str(path)) from e
    if regular:
        return open_file(path, every=opening.every, fps=opening.fps, factory=opening.factory)
    if exists:
        raise SourceError("it is neither a file nor a folder", where=str(path))
    raise SourceError(
        "there is no such file or folder",
        where=str(path),
        expected="a video file, a folder of images, a camera index or a URL",
        hint=_nearest(path),
    )


def _bag(path: Path) -> tuple[Path, str | None] | None:
    """A bag and the topic named after a `#`, or None when it is not a bag."""
    if path.exists():
        return (path, None) if is_bag(path) else None
    name, mark, topic = str(path).partition("#")
    return (Path(name), topic) if mark and is_bag(Path(name)) else None


def _nearest(path: Path) -> str:
    """A suggestion of the file of most similar name in the same folder, if any."""
    try:
        names = [p.name for p in path.parent.iterdir()]
    except OSError:
        return f"there is no folder {path.parent} that can be read"
    near = closest_file(path, names)
    return f"did you mean {near}?" if near else "check the name"

"""The images of a ROS 2 bag (`sensor_msgs/Image`, `CompressedImage`); needs `visup[ros]`.

Messages are decoded as the two types known to visup. Type definitions inside a bag are ignored: they would be
compiled to code, and a bag may come from strangers.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from itertools import islice, pairwise
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
from numpy.typing import NDArray

from visup.agent import Frame
from visup.agent.model.did_you_mean import closest
from visup.agent.model.errors import ExtraMissingError, SourceError
from visup.percepts.image_size import check_pixels
from visup.percepts.video.image_folder import UnreadableImageError, decode_image
from visup.percepts.video.source import DEFAULT_FPS, Ending, VideoSource, to_bgr
from visup.percepts.video.video_file import ContainerClock

IMAGE, COMPRESSED = "sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage"
BAG_SUFFIXES = (".mcap", ".db3")
RATE_MESSAGES = 50
"""Number of messages from which the rate is estimated, as the median interval."""

PLAIN = {
    "mono8": ("u1", 1),
    "8UC1": ("u1", 1),
    "bgr8": ("u1", 3),
    "8UC3": ("u1", 3),
    "rgb8": ("u1", 3),
    "bgra8": ("u1", 4),
    "8UC4": ("u1", 4),
    "rgba8": ("u1", 4),
    "mono16": ("u2", 1),
    "16UC1": ("u2", 1),
}
"""Encoding -> type of a value, values per pixel."""

# Bayer patterns are named by their first two rows; OpenCV names them by the second row and column.
BAYER = {"bayer_rggb8": "BG", "bayer_bggr8": "RG", "bayer_gbrg8": "GR", "bayer_grbg8": "GB"}
YUV = {"yuv422": "UYVY", "uyvy": "UYVY", "yuv422_yuy2": "YUY2", "yuyv": "YUY2"}


def is_bag(path: Path) -> bool:
    """Whether a path is a bag: a folder with `metadata.yaml` and storage, or a storage file."""
    if path.is_dir():
        described = (path / "metadata.yaml").is_file()
        return described and any(p.suffix in BAG_SUFFIXES for p in path.iterdir())
    return path.suffix.lower() in BAG_SUFFIXES and path.is_file()


def open_bag(
    path: Path, topic: str | None = None, *, every: int = 1, fps: float | None = None
) -> RosBag:
    """Open a bag.

    Args:
        path: A path for which `is_bag` holds.
        topic: The topic to read; None for the only one.
        every: Only every n-th image is decoded.
        fps: Images per second to assume in place of their stamps.

    Raises:
        ExtraMissingError: rosbags is not installed.
        SourceError: It cannot be read, has no images, or several topics with images and none was named.
    """
    try:
        from rosbags.rosbag2 import Reader
        from rosbags.typesys import Stores, get_typestore
    except ModuleNotFoundError as missing:
        raise ExtraMissingError("a ROS 2 bag", "ros") from missing
    reader: Any = None
    try:
        reader = Reader(path)
        reader.open()
        chosen = _chosen(path, reader.topics, topic)
        images = _ImageTopic(reader, chosen, get_typestore(Stores.LATEST))
        return RosBag(f"{path}#{chosen}", images, every=every, fps=fps)
    except SourceError:
        _close(reader)
        raise
    except Exception as fault:  # a damaged file may make the library raise anything
        _close(reader)
        raise SourceError(
            f"the bag cannot be read ({type(fault).__name__}: {fault})",
            where=str(path),
            expected="a ROS 2 bag: its folder, or its .mcap or .db3 file",
        ) from fault


def _close(reader: Any) -> None:
    if reader is not None:
        with suppress(Exception):
            reader.close()


def _chosen(path: Path, topics: dict[str, Any], wanted: str | None) -> str:
    """The topic to read."""
    known = [n for n, t in topics.items() if t.msgtype in (IMAGE, COMPRESSED) and t.msgcount]
    if not known:
        raise SourceError(
            "the bag has no pictures",
            where=str(path),
            expected=f"messages of type {IMAGE} or {COMPRESSED}",
            hint=f"it has: {', '.join(sorted(topics)) or 'nothing'}",
        )
    if wanted is None and len(known) == 1:
        return known[0]
    if wanted is not None:
        for name in known:
            if name.strip("/") == wanted.strip("/"):
                return name
    near = closest(wanted, known) if wanted else None
    raise SourceError(
        "the bag has no such pictures" if wanted else "the bag has pictures of several topics",
        where=f"{path}#{wanted}" if wanted else str(path),
        expected=f"one of: {', '.join(known)}",
        hint=f"name the topic: {path}#{near or known[0]}",
    )


@dataclass(frozen=True, slots=True)
class _ImageTopic:
    """The messages of one topic.

    Attributes:
        reader: An open `rosbags.rosbag2.Reader`.
        topic: Its name.
        types: The type store that deserialises messages.
    """

    reader: Any
    topic: str
    types: Any

    @property
    def count(self) -> int:
        """Number of messages."""
        return int(self.reader.topics[self.topic].msgcount)

    def messages(self) -> Iterator[tuple[float, str, bytes]]:
        """Time of recording in seconds, type, bytes."""
        wanted = [c for c in self.reader.connections if c.topic == self.topic]
        for connection, stamp, data in self.reader.messages(connections=wanted):
            yield stamp / 1e9, connection.msgtype, data

    def rate(self) -> float | None:
        """Images per second, or None if unknown."""
        times = [t for t, _, _ in islice(self.messages(), RATE_MESSAGES)]
        lasted = [b - a for a, b in pairwise(times) if b > a]
        return 1.0 / median(lasted) if lasted else None

    def image(self, kind: str, data: bytes) -> NDArray[np.uint8]:
        """The image of a message, (H, W, 3) uint8 BGR.

        Raises:
            UnreadableImageError: It cannot be decoded.
        """
        try:
            message = self.types.deserialize_cdr(data, kind)
            if kind == COMPRESSED:
                return decode_image(bytes(message.data))
            return _plain(message)
        except UnreadableImageError:
            raise
        except Exception as fault:  # a damaged message may make the library raise anything
            raise UnreadableImageError(f"cannot be decoded ({fault})") from fault


class RosBag(VideoSource):
    """The images of one topic as frames, at their recording times.

    Args:
        name: The bag and its topic.
        images: Its messages.
        every: Only every n-th image is decoded.
        fps: Images per second, or None for the rate of the first ones.

    Raises:
        SourceError: The first image cannot be decoded.
    """

    def __init__(
        self, name: str, images: _ImageTopic, *, every: int = 1, fps: float | None = None
    ) -> None:
        rate = fps or images.rate()
        self._topic = images
        self._clock = ContainerClock(rate or DEFAULT_FPS, constant=fps is not None)
        self._messages = enumerate(images.messages())
        _, self._first = next(self._messages)
        try:
            first = images.image(*self._first[1:])
        except UnreadableImageError as fault:
            raise SourceError(f"the first picture {fault}", where=name) from fault
        self._waiting: NDArray[np.uint8] | None = first
        super().__init__(
            name,
            fps=rate or DEFAULT_FPS,
            size=(first.shape[1], first.shape[0]),
            frame_count=images.count,
            every=every,
            notes=()
            if rate
            else (f"A single picture has no rate; {DEFAULT_FPS:g} fps is assumed.",),
        )

    def _next(self) -> Frame | None:
        if self._waiting is not None:
            image, self._waiting = self._waiting, None
            return Frame(0, self._clock.time(0, self._first[0]), image)
        index = -1
        try:
            for index, (stamp, kind, data) in self._messages:
                time = self._clock.time(index, stamp)
                if index % self.every == 0 and index >= self.span[0]:
                    return Frame(index, time, self._image(kind, data))
        except UnreadableImageError as fault:
            problem = f"picture {index} of {self.frame_count} {fault}"
        except Exception as fault:  # a damaged file may make the library raise anything
            problem = f"the bag cannot be read on ({type(fault).__name__}: {fault})"
        else:
            return None
        self._end(Ending.TRUNCATED, f"{problem}; what came before is kept.")
        return None

    def _image(self, kind: str, data: bytes) -> NDArray[np.uint8]:
        """One image, checked to have the size of the first."""
        image = self._topic.image(kind, data)
        size = (image.shape[1], image.shape[0])
        if size != self.size:
            before = f"{self.size[0]}x{self.size[1]}"
            raise UnreadableImageError(f"is {size[0]}x{size[1]}, but those before it are {before}")
        return image

    def _release(self) -> None:
        _close(self._topic.reader)


def _plain(message: Any) -> NDArray[np.uint8]:
    """An uncompressed image in BGR."""
    import cv2

    height, width, encoding = int(message.height), int(message.width), str(message.encoding)
    try:
        check_pixels(width, height)
    except ValueError as fault:
        raise UnreadableImageError(str(fault)) from fault
    name = encoding.lower() if encoding.lower() in (*PLAIN, *BAYER, *YUV) else encoding
    if name in BAYER:
        rows = _rows(message, "u1", 1)
        return np.asarray(
            cv2.cvtColor(rows, getattr(cv2, f"COLOR_Bayer{BAYER[name]}2BGR")), np.uint8
        )
    if name in YUV:
        rows = _rows(message, "u1", 2)
        return np.asarray(cv2.cvtColor(rows, getattr(cv2, f"COLOR_YUV2BGR_{YUV[name]}")), np.uint8)
    if name not in PLAIN:
        known = ", ".join((*PLAIN, *BAYER, *YUV))
        raise UnreadableImageError(f"is encoded as {encoding!r}, not as one of {known}")
    rows = _rows(message, *PLAIN[name])
    if name.startswith("rgb"):
        rows = rows[:, :, [2, 1, 0, 3][: rows.shape[2]]]
    return to_bgr(rows)


def _rows(message: Any, kind: str, values: int) -> NDArray[Any]:
    """The pixels of a message, (H, W, values), without row padding."""
    order = ">" if message.is_bigendian else "<"
    dtype = np.dtype(f"{order}{kind}")
    height, width, step = int(message.height), int(message.width), int(message.step)
    wide = width * values * dtype.itemsize
    data = np.asarray(message.data, np.uint8)
    if step < wide or data.size < step * height:
        raise UnreadableImageError(f"has {data.size} bytes, too few for {width}x{height}")
    packed = np.ascontiguousarray(data[: step * height].reshape(height, step)[:, :wide])
    native = packed.view(dtype).reshape(height, width, values)
    return native.astype(dtype.newbyteorder("="))

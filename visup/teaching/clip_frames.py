"""Frames of a clip by their number, as a user leafs through it; a single picture is a clip of one."""

from __future__ import annotations

from collections import OrderedDict
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np
from numpy.typing import NDArray

from visup.agent import Frame
from visup.agent.model.errors import SourceError
from visup.percepts.video import VideoSource, open_source
from visup.percepts.video.image_folder import UnreadableImageError, read_image

IMAGE_SUFFIXES = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".webp", ".pgm", ".ppm")
"""Endings of the files that are read as one picture."""

CACHE_BYTES = 1 << 26
"""Frames that were passed are kept up to so many bytes, so that going back a little costs nothing."""

MAX_SEEK = 40
"""Frames further ahead than so many are reached by passing over those before them undecoded."""

Picture = NDArray[np.uint8]


class ClipFrames:
    """The frames of a clip, counted from 0 as `visup watch` counts them.

    Frames are found by decoding from the start, since seeking in a video is not exact to a frame.

    Args:
        source: A video file, a folder of images, a camera, a URL, or a single picture.

    Attributes:
        name: As the user named it.
        count: How many frames it announces; None when that is not known.

    Raises:
        SourceError: It cannot be opened.
    """

    def __init__(self, source: str) -> None:
        self.name = source
        self._cache: OrderedDict[int, Picture] = OrderedDict()
        self._source: VideoSource | None = None
        self._next = 0
        path = Path(source).expanduser()
        if path.suffix.lower() in IMAGE_SUFFIXES and path.is_file():
            self._cache[0] = _read_picture(path)
            self.count: int | None = 1
        else:
            self._source = open_source(source)
            self.count = self._source.frame_count

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._source is not None:
            self._source.close()

    def at(self, number: int) -> Picture:
        """A frame.

        Args:
            number: From 0.

        Returns:
            (H, W, 3) uint8, BGR; not to be written to.

        Raises:
            SourceError: There is no such frame, or it is gone by: a camera cannot be rewound.
        """
        if number in self._cache:
            return self._cache[number]
        if number < 0 or self._source is None:
            raise self._missing(number)
        return self._read_to(self._seek(self._source, number), number)

    def _seek(self, source: VideoSource, number: int) -> VideoSource:
        """The source at or before a frame; what lies before a far one will be passed over undecoded."""
        if source.live:
            return source
        if number < self._next:
            source.close()
            source, self._next = open_source(self.name), 0
            self._source = source
        if number >= self._next + MAX_SEEK:
            source.span = (number, None)
        return source

    def _read_to(self, source: VideoSource, number: int) -> Picture:
        while self._next <= number:
            frame = next(source, None)
            if frame is None:
                self._next = number + 1  # so that a frame before is looked for from the start
                raise self._missing(number)
            self._next = frame.index + 1
            self._store(frame)
        if number not in self._cache:
            raise SourceError(
                f"frame {number} has gone by", where=self.name, hint="a camera cannot be rewound"
            )
        return self._cache[number]

    def _store(self, frame: Frame) -> None:
        self._cache[frame.index] = frame.image
        self._cache.move_to_end(frame.index)
        while len(self._cache) > max(2, CACHE_BYTES // max(1, frame.image.nbytes)):
            self._cache.popitem(last=False)

    def _missing(self, number: int) -> SourceError:
        expected = f"0 to {self.count - 1}" if self.count else "a frame's number, from 0"
        if self.count and 0 <= number < self.count:
            expected = "a smaller number: the video is shorter than it announces"
        return SourceError(f"there is no frame {number}", where=self.name, expected=expected)


def _read_picture(path: Path) -> Picture:
    try:
        return read_image(path)
    except UnreadableImageError as fault:
        raise SourceError(f"this picture {fault}", where=str(path)) from fault

"""The frames of a recorded run, read from its source if that still exists."""

from __future__ import annotations

from collections import OrderedDict
from pathlib import Path
from threading import Lock

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.agent import Mind
from visup.agent.model.errors import SourceError, VisupError
from visup.report.annotate import annotate
from visup.runs.replay_report import GREY
from visup.teaching.clip_frames import ClipFrames

JPEG_QUALITY = 85
MAX_CACHED_PICTURES = 32
Picture = NDArray[np.uint8]


class RunPictures:
    """Frames of one source, for any number of pages at once.

    Only local files and folders are opened, never a camera, a pipe or a URL: a run may come from a stranger,
    and viewing it must not make this machine connect anywhere.

    Args:
        source: The source as named by the run.

    Attributes:
        problem: Why there are no frames, or empty.
    """

    def __init__(self, source: str) -> None:
        self._frames_lock, self._frames = Lock(), None
        self._cache_lock, self._cache = Lock(), OrderedDict[tuple[int, bool], bytes]()
        self.problem = ""
        path = Path(source)
        if not source or not (path.is_file() or path.is_dir()):
            self.problem = "The video is no longer available: pictures show outlines only."
            return
        try:
            self._frames = ClipFrames(source)
        except VisupError as fault:
            self.problem = str(fault)

    def frame(self, mind: Mind) -> Picture:
        """The frame of a moment; a grey one if it is not available.

        Returns:
            (H, W, 3) uint8 BGR, of the size that was processed.
        """
        frame = self.source_frame(mind)
        return np.full((*mind.frame_size[::-1], 3), GREY, np.uint8) if frame is None else frame

    def source_frame(self, mind: Mind) -> Picture | None:
        """The frame of a moment, or None; (H, W, 3) uint8 BGR."""
        if self._frames is None:
            return None
        try:
            with self._frames_lock:
                frame = self._frames.at(mind.frame_index)
        except SourceError as fault:
            self.problem = str(fault)
            return None
        return frame if frame.shape[:2] == mind.frame_size[::-1] else None

    def annotated(self, mind: Mind, *, plain: bool = False) -> bytes:
        """A moment as JPEG, with the beliefs drawn over it unless `plain`.

        Pages that follow a run ask for the same moments, so the last ones are kept.
        """
        key = mind.frame_index, plain
        with self._cache_lock:
            if key not in self._cache:
                image = self.frame(mind)
                self._cache[key] = jpeg(image if plain else annotate(image, mind))
                if len(self._cache) > MAX_CACHED_PICTURES:
                    self._cache.popitem(last=False)
            return self._cache[key]


def jpeg(image: Picture) -> bytes:
    """An image as a JPEG file.

    Args:
        image: (H, W, 3) uint8 BGR.
    """
    return bytes(cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])[1])

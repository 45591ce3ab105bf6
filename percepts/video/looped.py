"""A clip played in a loop as if from a camera, to rehearse a supervisor without one."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from visup.percepts.video.capture import Capture, CaptureFactory, frame_rate
from visup.percepts.video.waiting_clock import WaitingClock

LOOP = "loop:"
"""Prefix of such a source: `loop:clip.mp4`."""


class LoopedCapture:
    """A capture of a clip that restarts at its end, with each frame at its time.

    Like a camera it does not wait: a late reader gets the next frames at once until it has caught up with
    the clip's own times.

    Args:
        path: The clip.
        factory: Opens it.
        fps: Frames per second, in place of the clip's own.
        clock: Clock of the playback.
    """

    def __init__(
        self,
        path: str,
        factory: CaptureFactory,
        fps: float | None = None,
        clock: WaitingClock | None = None,
    ) -> None:
        self._path, self._factory = path, factory
        self._clock = clock or WaitingClock()
        self._clip: Capture = factory(path)
        self._pause = 1.0 / frame_rate(self._clip, fps)[0]
        self._due: float | None = None

    def isOpened(self) -> bool:
        """Whether the clip could be opened."""
        return self._clip.isOpened()

    def grab(self) -> bool:
        """Wait until the next frame is due, and advance to it; False when the clip is empty."""
        now = self._clock.now()
        self._due = now if self._due is None else self._due + self._pause
        if self._due > now:
            self._clock.wait(self._due - now)
        return self._clip.grab() or self._restart()

    def retrieve(self) -> tuple[bool, NDArray[np.generic]]:
        """Decode the frame."""
        return self._clip.retrieve()

    def get(self, prop: int) -> float:
        """A property of the clip."""
        return self._clip.get(prop)

    def release(self) -> None:
        """Close the clip."""
        self._clip.release()

    def _restart(self) -> bool:
        self._clip.release()
        self._clip = self._factory(self._path)
        return self._clip.isOpened() and self._clip.grab()

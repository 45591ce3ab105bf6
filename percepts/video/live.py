"""A camera or a stream: frames that are made while they are read."""

from __future__ import annotations

import time
from collections.abc import Callable

from visup.agent import Frame
from visup.agent.errors import SourceError
from visup.percepts.video.base import Ending, Source
from visup.percepts.video.capture import Capture, frame_rate, take


class LiveSource(Source):
    """A camera or stream; the time of a frame is when it was received.

    Args:
        name: What the user named.
        capture: An open capture.
        every: Only every n-th frame is given.
        fps: Frame rate to assume, or None for what the camera says.
        clock: Seconds from any start; an argument so that a run can be repeated.

    Raises:
        SourceError: It delivers no frame.
    """

    def __init__(
        self,
        name: str,
        capture: Capture,
        *,
        every: int = 1,
        fps: float | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        rate, notes = frame_rate(capture, fps)
        self._capture = capture
        self._clock = clock
        self._received = 0
        self._start = 0.0
        self._last_time = -1.0
        first = self._advance(every=1)
        if first is None:
            capture.release()
            raise SourceError(
                "it is open but delivers no frame",
                where=name,
                expected="a camera or stream that delivers frames",
                hint="check that nothing else uses it",
            )
        self._waiting: Frame | None = first
        super().__init__(
            name, fps=rate, size=first.size, frame_count=None, every=every, live=True, notes=notes
        )

    def _next(self) -> Frame | None:
        frame, self._waiting = self._waiting, None
        if frame is None:
            frame = self._advance(self.every)
        if frame is None:
            self._end(
                Ending.TRUNCATED,
                f"{self.name} stopped delivering frames after {self._last_time:.2f} s.",
            )
        elif frame.size != self.size:
            self._end(Ending.TRUNCATED, f"{self.name} changed its image size.")
            return None
        return frame

    def _advance(self, every: int) -> Frame | None:
        """Receive until a wanted frame is there."""
        while self._capture.grab():
            index, self._received = self._received, self._received + 1
            now = self._clock()
            if index == 0:
                self._start = now
            # A coarse clock may stand still between two frames, but time never does.
            self._last_time = max(now - self._start, self._last_time + 1e-6 if index else 0.0)
            image = None if index % every else take(self._capture)
            if image is not None:
                return Frame(index, self._last_time, image)
        return None

    def _release(self) -> None:
        self._capture.release()

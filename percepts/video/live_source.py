"""Live sources: cameras and streams, with reconnection."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from visup.agent import AlertCondition, Frame, Severity
from visup.agent.cycle.system_alerts import SOURCE_DROPPED
from visup.agent.model.errors import SourceError
from visup.percepts.video.capture import Capture, frame_rate, take
from visup.percepts.video.source import Ending, VideoSource

FIRST_WAIT_S = 0.5
LONGEST_WAIT_S = 10.0


@dataclass(frozen=True, slots=True)
class Reconnection:
    """How to reopen a source that has dropped.

    Attributes:
        reopen: Opens it.
        patience_s: How long to retry, seconds.
        wait: Sleeps for a number of seconds; injectable for tests.
    """

    reopen: Callable[[], Capture]
    patience_s: float
    wait: Callable[[float], None] = time.sleep


class LiveSource(VideoSource):
    """A camera or stream; the time of a frame is when it was received.

    When it drops it is reopened with increasing intervals until it is back or patience runs out. Frame
    numbers and times continue.

    Args:
        name: The user's name for it.
        capture: An open capture.
        every: Only every n-th frame is returned.
        fps: Frame rate to assume, or None for what the camera says.
        clock: Seconds from any start; injectable for reproducible runs.
        reconnection: How to reopen it; None to end when it drops.

    Attributes:
            notify: Called with a sentence as soon as it drops, while no step can run.

    Raises:
        SourceError: It delivers no frame.
    """

    live = True

    def __init__(
        self,
        name: str,
        capture: Capture,
        *,
        every: int = 1,
        fps: float | None = None,
        clock: Callable[[], float] = time.monotonic,
        reconnection: Reconnection | None = None,
    ) -> None:
        rate, notes = frame_rate(capture, fps)
        self.notify: Callable[[str], None] | None = None
        self._reconnection = reconnection
        # Written by the frame reader, possibly in its own thread, and read by the agent's cycle.
        self._came_back: deque[str] = deque()
        self._capture = capture
        self._clock = clock
        self._received = 0
        self._start = 0.0
        self._last_time = -1.0
        first = self._advance(every=1)
        if first is None:
            capture.release()
            raise SourceError(
                "it is open but delivers no frames",
                where=name,
                expected="a camera or stream that delivers frames",
                hint="check that nothing else uses it",
            )
        self._waiting: Frame | None = first
        super().__init__(
            name, fps=rate, size=first.size, frame_count=None, every=every, notes=notes
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

    def runtime_faults(self) -> Iterable[AlertCondition]:
        """Reported once after it came back: how long it was gone."""
        while self._came_back:
            message = self._came_back.popleft()
            yield AlertCondition(
                SOURCE_DROPPED, (), Severity.WARNING, message, key=self.name, needs=()
            )

    def _grab(self) -> bool:
        return self._capture.grab() or (self._received > 0 and self._reconnected())

    def _reconnected(self) -> bool:
        """Retry until a frame can be received; whether that succeeded."""
        reconnection = self._reconnection
        if reconnection is None or reconnection.patience_s <= 0:
            return False
        if self.notify:
            self.notify(f"{self.name} delivers no frames; trying again.")
        since, pause = self._clock(), FIRST_WAIT_S
        while (gone_s := self._clock() - since) < reconnection.patience_s:
            self._capture.release()
            reconnection.wait(min(pause, reconnection.patience_s - gone_s))
            pause = min(2 * pause, LONGEST_WAIT_S)
            self._capture = reconnection.reopen()
            if self._capture.isOpened() and self._capture.grab():
                gone_s = self._clock() - since
                self._came_back.append(f"{self.name} delivered nothing for {gone_s:.1f} s.")
                return True
        return False

    def _advance(self, every: int) -> Frame | None:
        """Receive frames up to the next wanted one."""
        while self._grab():
            index, self._received = self._received, self._received + 1
            now = self._clock()
            if index == 0:
                self._start = now
            # Keeps times strictly increasing when the clock is coarse.
            self._last_time = max(now - self._start, self._last_time + 1e-6 if index else 0.0)
            image = None if index % every else take(self._capture)
            if image is not None:
                return Frame(index, self._last_time, image)
        return None

    def _release(self) -> None:
        self._capture.release()

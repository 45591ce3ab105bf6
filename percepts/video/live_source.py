"""A camera or a stream: frames that are made while they are read."""

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
    """How a source that delivers nothing any more is opened again.

    Attributes:
        reopen: Opens it.
        patience_s: How long to try, seconds.
        wait: Waits so many seconds; an argument for tests.
    """

    reopen: Callable[[], Capture]
    patience_s: float
    wait: Callable[[float], None] = time.sleep


class LiveSource(VideoSource):
    """A camera or stream; the time of a frame is when it was received.

    When it delivers nothing any more it is opened again, at first soon and then ever more seldom, until
    it is back or patience is at an end. Numbers and times of frames go on.

    Args:
        name: What the user named.
        capture: An open capture.
        every: Only every n-th frame is given.
        fps: Frame rate to assume, or None for what the camera says.
        clock: Seconds from any start; an argument so that a run can be repeated.
        reconnection: How it is opened again; None to end when it drops.

    Attributes:
        notify: Told at once when it drops, while nobody can step: one sentence.

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
        # Written by whoever reads frames, which may be a thread of its own, and read by the cycle.
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
        """Once after it came back: how long nothing was delivered."""
        while self._came_back:
            said = self._came_back.popleft()
            yield AlertCondition(
                SOURCE_DROPPED, (), Severity.WARNING, said, key=self.name, needs=()
            )

    def _grab(self) -> bool:
        return self._capture.grab() or (self._received > 0 and self._back_again())

    def _back_again(self) -> bool:
        """Open it again and again; whether a frame can be received."""
        again = self._reconnection
        if again is None or again.patience_s <= 0:
            return False
        if self.notify:
            self.notify(f"{self.name} delivers no frames; trying again.")
        since, pause = self._clock(), FIRST_WAIT_S
        while (gone := self._clock() - since) < again.patience_s:
            self._capture.release()
            again.wait(min(pause, again.patience_s - gone))
            pause = min(2 * pause, LONGEST_WAIT_S)
            self._capture = again.reopen()
            if self._capture.isOpened() and self._capture.grab():
                gone = self._clock() - since
                self._came_back.append(f"{self.name} delivered nothing for {gone:.1f} s.")
                return True
        return False

    def _advance(self, every: int) -> Frame | None:
        """Receive until a wanted frame is there."""
        while self._grab():
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

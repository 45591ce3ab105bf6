"""Real-time playback: a late reader gets the newest frame, and those in between are dropped.

The policy, in one place: *the newest frame that is due*. A frame is due when it was received, or, for a
recording played as if from a camera, when its time has come. Of the frames that became due while the previous
one was processed, all but the newest are dropped; frames keep their numbers and times, so that later stages
know how long the gap was. Dropped frames are counted and reported (`runtime_faults`, `dropped`).
A recording needs no thread, and with an injected clock the same frames are dropped each time. A live source
is read in a thread, since a capture that is not drained returns old frames later.
"""

from __future__ import annotations

import threading
import time
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Iterable, Iterator

from visup.agent import AlertCondition, Frame, Severity
from visup.agent.cycle.system_alerts import FRAMES_DROPPED
from visup.percepts.video.source import VideoSource

WINDOW_S = 5.0
SHARE = 0.1
"""Dropped share of the frames of the window from which it is reported, until none was dropped."""

LONG_S = 1.0
"""Time without a processed frame from which it is a warning, seconds."""

PATIENCE_S = 5.0
"""Longest wait for a reader to end, seconds; one stuck in its capture is abandoned."""


class RealTimeFrames(Iterator[Frame], ABC):
    """Frames in real time.

    Args:
        name: Name of their source.
        clock: Seconds from any start.

    Attributes:
        dropped: Frames dropped so far.
        given: Frames returned so far.
    """

    def __init__(self, name: str, clock: Callable[[], float] = time.monotonic) -> None:
        self.name = name
        self.clock = clock
        self.dropped = 0
        self.given = 0
        self._recent: deque[tuple[float, int, float]] = deque()  # time, dropped, seconds before it
        self._origin: float | None = None
        self._reported = False

    def lag(self, time: float) -> float:
        """Age of a frame, seconds, assuming that the first came without delay.

        Args:
            time: Time of the frame, seconds.
        """
        return 0.0 if self._origin is None else max(0.0, self.clock() - self._origin - time)

    def __next__(self) -> Frame:
        frame, missed = self._newest()
        if self._origin is None:
            self._origin = self.clock() - frame.time
        self.dropped += missed
        self.given += 1
        since = frame.time - self._recent[-1][0] if self._recent else 0.0
        self._recent.append((frame.time, missed, since))
        while frame.time - self._recent[0][0] > WINDOW_S:
            self._recent.popleft()
        lost, shown = self._lost(), len(self._recent)
        # With one limit for both, an alert would open and close every few seconds near that limit.
        self._reported = lost > 0 and (self._reported or lost >= SHARE * (lost + shown))
        return frame

    def _lost(self) -> int:
        return sum(missed for _, missed, _ in self._recent)

    def runtime_faults(self) -> Iterable[AlertCondition]:
        """Reports dropped frames from a tenth of the recent ones on, until none of them was."""
        if not self._reported:
            return
        lost, longest = self._lost(), max(since for _, _, since in self._recent)
        text = (
            f"Frames come faster than they can be watched: {lost} of the last "
            f"{lost + len(self._recent)} were dropped; for up to {longest:.1f} s nobody looked."
        )
        severity = Severity.WARNING if longest >= LONG_S else Severity.INFO
        yield AlertCondition(FRAMES_DROPPED, (), severity, text, key=self.name, needs=())

    def note(self) -> str | None:
        """A sentence for the end of a run; None when no frame was dropped."""
        if not self.dropped:
            return None
        whole = self.dropped + self.given
        return f"To keep pace with the clock, {self.dropped} of {whole} frames were dropped."

    def close(self) -> None:
        """Stop reading."""

    @abstractmethod
    def _newest(self) -> tuple[Frame, int]:
        """The newest due frame, after waiting if there is none, and the number dropped before it.

        Raises:
            StopIteration: There are no more frames.
        """


class PacedRecording(RealTimeFrames):
    """A recording played as if from a camera.

    Args:
        frames: The recording, or the rest of it.
        name: Its name.
        clock: Seconds from any start.
        wait: Sleeps for a number of seconds.
    """

    def __init__(
        self,
        frames: Iterator[Frame],
        name: str,
        *,
        clock: Callable[[], float] = time.monotonic,
        wait: Callable[[float], None] = time.sleep,
    ) -> None:
        super().__init__(name, clock)
        self._frames, self._wait = frames, wait
        self._start: float | None = None
        self._ahead: Frame | None = None

    def _newest(self) -> tuple[Frame, int]:
        frame, missed = self._ahead or next(self._frames), 0
        if self._start is None:
            self._start = self.clock() - frame.time
        now = self.clock() - self._start
        if frame.time > now:
            self._wait(frame.time - now)
        self._ahead = next(self._frames, None)
        while self._ahead is not None and self._ahead.time <= now:
            frame, missed = self._ahead, missed + 1
            self._ahead = next(self._frames, None)
        return frame, missed


class LatestFrames(RealTimeFrames):
    """A live source, read as fast as it delivers.

    Args:
        frames: Its frames; nothing else may read them.
        source: The source itself.
    """

    def __init__(self, frames: Iterator[Frame], source: VideoSource) -> None:
        super().__init__(source.name)
        self._frames, self._source = frames, source
        self._changed = threading.Condition()
        self._slot: Frame | None = None
        self._missed = 0
        self._fault: BaseException | None = None
        self._ended = self._stop = False
        self._reader = threading.Thread(target=self._read, name="video reader", daemon=True)
        self._reader.start()

    def _read(self) -> None:
        try:
            for frame in self._frames:
                with self._changed:
                    self._missed += self._slot is not None
                    self._slot = frame
                    self._changed.notify()
                    if self._stop:
                        break
        except Exception as fault:
            self._fault = fault  # raised in the consumer's thread
        with self._changed:
            self._ended = True
            self._changed.notify()

    def _newest(self) -> tuple[Frame, int]:
        with self._changed:
            self._changed.wait_for(lambda: self._slot is not None or self._ended)
            frame, missed = self._slot, self._missed
            self._slot, self._missed = None, 0
        if frame is not None:
            return frame, missed
        if self._fault is not None:
            raise self._fault
        raise StopIteration

    def close(self) -> None:
        """Stop reading; a source whose reader is stuck is abandoned until the process ends."""
        self._stop = True
        self._reader.join(PATIENCE_S)
        if self._reader.is_alive():
            self._source.abandon()


def in_real_time(source: VideoSource, frames: Iterator[Frame]) -> RealTimeFrames:
    """Frames of any source in real time.

    Args:
        source: The source.
        frames: Its frames, or the rest of them.
    """
    return LatestFrames(frames, source) if source.live else PacedRecording(frames, source.name)

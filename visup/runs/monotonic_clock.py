"""A monotonic clock for reasoning, whatever the clock of a source does."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator

from visup.agent import AlertCondition, Frame, Severity
from visup.agent.cycle.system_alerts import CLOCK_JUMPED

NAME = "clock"


class MonotonicFrames:
    """Frames with strictly increasing times; others are moved to one frame period after the previous one.

    Args:
        frames: A source, or any other frames.
        fps: Frame rate.
        after: Time of the frame before the first, seconds; None if there was none.
    """

    def __init__(self, frames: Iterable[Frame], fps: float, after: float | None = None) -> None:
        self._frames = iter(frames)
        self._period = 1.0 / fps
        self._last = after
        self._shift = 0.0
        self._reported: str | None = None

    def __iter__(self) -> Iterator[Frame]:
        return self

    def __next__(self) -> Frame:
        frame = next(self._frames)
        time = frame.time + self._shift
        if not math.isfinite(time) or (self._last is not None and time <= self._last):
            begin = 0.0 if self._last is None else self._last + self._period
            self._reported = f"The clock of the source jumped from {self._last} s to {time} s."
            # A clock that was set stays so: later frames keep their time difference to this one.
            self._shift += begin - time if math.isfinite(time) else 0.0
            time = begin
        self._last = time
        return frame if time == frame.time else Frame(frame.index, time, frame.image)

    def runtime_faults(self) -> Iterable[AlertCondition]:
        """One fault after each jump of the clock."""
        cause, self._reported = self._reported, None
        if cause:
            yield AlertCondition(CLOCK_JUMPED, (), Severity.WARNING, cause, key=NAME, needs=())

"""A monotonic clock for reasoning, whatever the clock of a source does."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator

from visup.agent import AlertCondition, Frame, Severity
from visup.agent.cycle.system_alerts import CLOCK_JUMPED

NAME = "clock"


class MonotonicFrames:
    """Frames whose times always grow; those that do not are put one frame after the one before.

    Args:
        frames: A source, or frames of any other origin.
        fps: Its frame rate.
        after: Time of the frame before the first one, seconds; None when there was none.
    """

    def __init__(self, frames: Iterable[Frame], fps: float, after: float | None = None) -> None:
        self._frames = iter(frames)
        self._pause = 1.0 / fps
        self._last = after
        self._shift = 0.0
        self._said: str | None = None

    def __iter__(self) -> Iterator[Frame]:
        return self

    def __next__(self) -> Frame:
        frame = next(self._frames)
        time = frame.time + self._shift
        if not math.isfinite(time) or (self._last is not None and time <= self._last):
            begin = 0.0 if self._last is None else self._last + self._pause
            self._said = f"The clock of the source jumped from {self._last} s to {time} s."
            # A clock that was set stays so: later frames keep their distance to this one.
            self._shift += begin - time if math.isfinite(time) else 0.0
            time = begin
        self._last = time
        return frame if time == frame.time else Frame(frame.index, time, frame.image)

    def runtime_faults(self) -> Iterable[AlertCondition]:
        """Once after a jump: that there was one."""
        said, self._said = self._said, None
        if said:
            yield AlertCondition(CLOCK_JUMPED, (), Severity.WARNING, said, key=NAME, needs=())

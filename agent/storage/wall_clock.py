"""Wall-clock times (UTC) of a run, in addition to the seconds of its source.

Reasoning uses seconds of the source, so that equal frames give equal events. For a camera the arrival time of
frames is known, too. It is stored as anchors: pairs of source time and wall-clock time. One is enough while
both clocks agree; more are added when a run is resumed or the wall clock is set.
"""

from __future__ import annotations

import math
import socket
import time
from bisect import bisect_right
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from itertools import pairwise
from typing import Any

from visup.agent.model.records import Frame
from visup.agent.model.step import Step

TOLERANCE_S = 1.0
"""Tolerated difference of the clocks, seconds: records say when something happened, not how long it took."""

MAX_ANCHORS = 10_000
LATEST = 253402300799.0
"""The end of the year 9999; later times are not valid."""


@dataclass(frozen=True, slots=True)
class WallClock:
    """Converts source times to wall-clock times.

    Attributes:
        anchors: Pairs of source seconds and seconds since 1970 in UTC, ascending by source seconds.
    """

    anchors: tuple[tuple[float, float], ...] = ()

    @classmethod
    def read(cls, recorded: object) -> WallClock:
        """The clock of a recorded run; without anchors if there is no valid one."""
        pairs = recorded if isinstance(recorded, list | tuple) else ()
        anchors = tuple(
            (float(pair[0]), float(pair[1]))
            for pair in pairs[:MAX_ANCHORS]
            if isinstance(pair, list | tuple) and len(pair) == 2 and all(map(_is_time, pair))
        )
        ascends = all(a[0] < b[0] for a, b in pairwise(anchors))
        return cls(anchors if ascends else ())

    def seconds(self, time_s: float) -> float | None:
        """Seconds since 1970 at a source time, or None if unknown.

        >>> WallClock(((0.0, 1000.0), (60.0, 5000.0))).seconds(61.5)
        5001.5
        """
        if not self.anchors:
            return None
        number = bisect_right(self.anchors, (time_s, math.inf)) - 1
        at, wall = self.anchors[max(0, number)]
        return wall + time_s - at

    def text(self, time_s: float) -> str | None:
        """The same as text, or None.

        >>> WallClock(((0.0, 0.0),)).text(90.0625)
        '1970-01-01T00:01:30.062Z'
        """
        seconds = self.seconds(time_s)
        return None if seconds is None else utc_text(seconds)

    def anchored(self, time_s: float, wall_s: float) -> WallClock:
        """This clock if it agrees with the given times, else one with a further anchor.

        Args:
            time_s: Source seconds, not before the last anchor.
            wall_s: Seconds since 1970.
        """
        known = self.seconds(time_s)
        if known is not None and abs(known - wall_s) <= TOLERANCE_S:
            return self
        earlier = [a for a in self.anchors if a[0] < time_s]
        return WallClock((*earlier, (time_s, wall_s))[-MAX_ANCHORS:])


def _is_time(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and 0 <= value <= LATEST


def utc_text(seconds: float) -> str:
    """Seconds since 1970 as a sortable text with milliseconds and time zone.

    >>> utc_text(1795455235.0181)
    '2026-11-23T17:33:55.018Z'
    """
    moment = datetime.fromtimestamp(min(max(seconds, 0.0), LATEST), UTC)
    return moment.strftime("%Y-%m-%dT%H:%M:%S.") + f"{moment.microsecond // 1000:03d}Z"


class RecordStamp:
    """The fields common to all records: camera, host, and wall-clock time.

    An observer of the steps of a camera; other sources have no wall-clock time.

    Args:
        camera: Its name; None to leave out camera and host.
        clock: Clock of the earlier part of the run.
        live: Whether the source is a live camera, so that records without a time are of now.
        now: Seconds since 1970.

    Attributes:
        clock: The present clock.
        lag: Age of a source time, seconds.
        changed: Receives each further anchor.
    """

    def __init__(
        self,
        camera: str | None = None,
        clock: WallClock | None = None,
        *,
        live: bool = False,
        now: Callable[[], float] = time.time,
    ) -> None:
        self.named = {"camera": camera, "host": socket.gethostname()} if camera else {}
        self._live = live
        self.clock = clock or WallClock()
        self.lag: Callable[[float], float] = lambda time_s: 0.0
        self.changed: Callable[[WallClock], None] = lambda clock: None
        self._now = now

    def __call__(self, step: Step, frame: Frame) -> None:
        """Compare the clocks after a step."""
        clock = self.clock.anchored(step.time, self._now() - self.lag(step.time))
        if clock is not self.clock:
            self.clock = clock
            self.changed(clock)

    def of(self, time_s: float | None) -> Mapping[str, Any]:
        """The keys of a record.

        Args:
            time_s: Source seconds; None for now.
        """
        now = utc_text(self._now()) if self._live else None
        at = now if time_s is None else self.clock.text(time_s)
        return {**self.named, **({"at": at} if at else {})}

"""Counters and gauges of a camera over all its processes; totals never decrease."""

from __future__ import annotations

from collections.abc import Mapping
from math import isfinite
from typing import Any

COUNTED = ("frames", "dropped", "cpu_s", "alerts_info", "alerts_warning", "alerts_critical")
PHASE = "ms_"
"""Prefix of the name of a phase; the value is its time in milliseconds."""

MEASURED = ("lag_s", "objects", "alerts_open")


class CameraFigures:
    """Counters and gauges of a camera.

    Attributes:
        latest: The gauges as last reported.
    """

    def __init__(self) -> None:
        self.latest: dict[str, float] = {}
        self._before: dict[str, float] = {}
        self._now: dict[str, float] = {}

    def take(self, reported: Mapping[str, Any]) -> None:
        """Store the figures that a process reports; values that are not finite numbers are ignored."""
        for name, value in reported.items():
            if not isinstance(value, int | float) or isinstance(value, bool) or not isfinite(value):
                continue
            if name in COUNTED or name.startswith(PHASE):
                self._now[name] = float(value)
            elif name in MEASURED:
                self.latest[name] = float(value)

    def process_ended(self) -> None:
        """Start again from 0 for the next process."""
        self._before = dict(self.totals)
        self._now = {}
        self.latest = {}

    @property
    def totals(self) -> Mapping[str, float]:
        """The counters over all processes so far."""
        names = [*self._before, *(n for n in self._now if n not in self._before)]
        return {n: self._before.get(n, 0.0) + self._now.get(n, 0.0) for n in names}

"""Counters and gauges of a camera over all its processes; totals never decrease."""

from __future__ import annotations

from collections.abc import Mapping
from math import isfinite
from typing import Any

COUNTERS = ("frames", "dropped", "cpu_s", "alerts_info", "alerts_warning", "alerts_critical")
PHASE = "ms_"
"""Prefix of the name of a phase; the value is its time in milliseconds."""

GAUGES = ("lag_s", "objects", "alerts_open")


class CameraFigures:
    """Counters and gauges of a camera.

    Attributes:
        latest: The gauges as last reported.
    """

    def __init__(self) -> None:
        self.latest: dict[str, float] = {}
        self._earlier_processes: dict[str, float] = {}
        self._this_process: dict[str, float] = {}

    def update(self, reported: Mapping[str, Any]) -> None:
        """Store the figures that a process reports; values that are not finite numbers are ignored."""
        for name, value in reported.items():
            if not isinstance(value, int | float) or isinstance(value, bool) or not isfinite(value):
                continue
            if name in COUNTERS or name.startswith(PHASE):
                self._this_process[name] = float(value)
            elif name in GAUGES:
                self.latest[name] = float(value)

    def process_ended(self) -> None:
        """Start again from 0 for the next process."""
        self._earlier_processes = dict(self.totals)
        self._this_process = {}
        self.latest = {}

    @property
    def totals(self) -> Mapping[str, float]:
        """The counters over all processes so far."""
        names = [
            *self._earlier_processes,
            *(n for n in self._this_process if n not in self._earlier_processes),
        ]
        return {
            n: self._earlier_processes.get(n, 0.0) + self._this_process.get(n, 0.0) for n in names
        }

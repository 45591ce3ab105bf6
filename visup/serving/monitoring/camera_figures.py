"""What is counted of a camera over all its processes: each counts from nothing, the sums never go back."""

from __future__ import annotations

from collections.abc import Mapping
from math import isfinite
from typing import Any

COUNTED = ("frames", "dropped", "cpu_s", "alerts_info", "alerts_warning", "alerts_critical")
PHASE = "ms_"
"""Before the name of a phase: milliseconds that it took."""

MEASURED = ("lag_s", "objects", "alerts_open")


class CameraFigures:
    """Sums and latest figures of a camera.

    Attributes:
        latest: Figures that go up and down, as they were told last.
    """

    def __init__(self) -> None:
        self.latest: dict[str, float] = {}
        self._before: dict[str, float] = {}
        self._now: dict[str, float] = {}

    def take(self, told: Mapping[str, Any]) -> None:
        """Take note of what a process tells of itself; what is no figure is left out."""
        for name, value in told.items():
            if not isinstance(value, int | float) or isinstance(value, bool) or not isfinite(value):
                continue
            if name in COUNTED or name.startswith(PHASE):
                self._now[name] = float(value)
            elif name in MEASURED:
                self.latest[name] = float(value)

    def process_ended(self) -> None:
        """The next process counts from nothing."""
        self._before = dict(self.totals)
        self._now = {}
        self.latest = {}

    @property
    def totals(self) -> Mapping[str, float]:
        """Sums over all processes so far."""
        names = [*self._before, *(n for n in self._now if n not in self._before)]
        return {n: self._before.get(n, 0.0) + self._now.get(n, 0.0) for n in names}

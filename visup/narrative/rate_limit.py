"""The rate limit of the narrative."""

from __future__ import annotations

from dataclasses import dataclass, field

MAX_BURST, INITIAL_ALLOWANCE = 2, 1
LINE_INTERVAL_S = 7.5
"""Burst size in lines, its value at the start, and seconds per further line: at most ten in any minute.

The lower start keeps short clips to about ten a minute, too.
"""


@dataclass(slots=True)
class LineRateLimit:
    """A rate limit for lines, by the clock of the run.

    Attributes:
        max_burst: Maximum number of lines at once.
        interval_s: Seconds after which one more is allowed.
    """

    max_burst: int = MAX_BURST
    interval_s: float = LINE_INTERVAL_S
    _allowance: float = field(default=float(INITIAL_ALLOWANCE), init=False)
    _time: float | None = field(default=None, init=False)

    def begin(self, now: float) -> None:
        """Start the clock, seconds; only the first call counts."""
        self._time = now if self._time is None else self._time

    def allow(self, now: float) -> bool:
        """Whether one more line may be printed now (seconds); if so, it is counted."""
        elapsed = 0.0 if self._time is None else max(0.0, now - self._time)
        self._time = now
        self._allowance = min(float(self.max_burst), self._allowance + elapsed / self.interval_s)
        # Times are not exact tenths: a line that is due but for a rounding error is due.
        if self._allowance < 1.0 - 1e-6:
            return False
        self._allowance -= 1.0
        return True

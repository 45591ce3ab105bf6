"""The rate limit of the narrative."""

from __future__ import annotations

from dataclasses import dataclass, field

AT_ONCE, AT_START = 2, 1
EVERY_S = 7.5
"""So many lines may come at once, and then one in so many seconds: at most ten in any minute.

Less is saved at the start, so that a short clip has hardly more than ten a minute, too.
"""


@dataclass(slots=True)
class LineBudget:
    """A rate limit for lines, by the clock of the run.

    Attributes:
        at_once: Most lines that may come together.
        every_s: One more may come after so many seconds.
    """

    at_once: int = AT_ONCE
    every_s: float = EVERY_S
    _saved: float = field(default=float(AT_START), init=False)
    _at: float | None = field(default=None, init=False)

    def begin(self, now: float) -> None:
        """Start the clock, seconds; only the first call counts."""
        self._at = now if self._at is None else self._at

    def take(self, now: float) -> bool:
        """Whether one more line may be printed now (seconds); if so, it is counted."""
        lasted = 0.0 if self._at is None else max(0.0, now - self._at)
        self._at = now
        self._saved = min(float(self.at_once), self._saved + lasted / self.every_s)
        # Seconds are no exact tenths: a line that is due a rounding error later is due.
        if self._saved < 1.0 - 1e-6:
            return False
        self._saved -= 1.0
        return True

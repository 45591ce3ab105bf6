"""Exponential backoff for restarting a camera process that ended."""

from __future__ import annotations

from dataclasses import dataclass, replace

FIRST_WAIT_S = 1.0
LONGEST_WAIT_S = 60.0
CALM_S = 20.0
"""A process that ran at least this long counts as healthy and resets the backoff. Starting takes about 3 s of
processor time, so one that crashes every 20 s costs little more than one that keeps running."""


@dataclass(frozen=True, slots=True)
class Backoff:
    """The backoff state of one process.

    Attributes:
        failures: Consecutive failures since the last healthy run.
    """

    failures: int = 0

    @property
    def wait_s(self) -> float:
        """Seconds to wait before the next start.

        >>> [Backoff(n).wait_s for n in (1, 2, 3, 9)]
        [1.0, 2.0, 4.0, 60.0]
        """
        doubled = FIRST_WAIT_S * 2.0 ** min(self.failures - 1, 30)
        return min(LONGEST_WAIT_S, doubled) if self.failures else 0.0

    def after(self, ran_s: float) -> Backoff:
        """The state after the process ended again.

        Args:
            ran_s: How long the process made steps, seconds.
        """
        return replace(self, failures=1 if ran_s >= CALM_S else self.failures + 1)

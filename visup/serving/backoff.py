"""Exponential backoff for restarting a camera process that ended."""

from __future__ import annotations

from dataclasses import dataclass, replace

INITIAL_WAIT_S = 1.0
MAX_WAIT_S = 60.0
HEALTHY_S = 20.0
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
        wait = INITIAL_WAIT_S * 2.0 ** min(self.failures - 1, 30)
        return min(MAX_WAIT_S, wait) if self.failures else 0.0

    def after(self, ran_s: float) -> Backoff:
        """The state after the process ended again.

        Args:
            ran_s: How long the process made steps, seconds.
        """
        return replace(self, failures=1 if ran_s >= HEALTHY_S else self.failures + 1)

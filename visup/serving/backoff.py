"""When a camera that ended is begun again: soon at first, then ever more seldom."""

from __future__ import annotations

from dataclasses import dataclass, replace

FIRST_WAIT_S = 1.0
LONGEST_WAIT_S = 60.0
CALM_S = 20.0
"""Whoever has run for so long is taken to be well: the next time it is begun again soon. To begin takes some
three seconds of a processor: one that ends every 20 s for ever costs little more than one that runs."""


@dataclass(frozen=True, slots=True)
class Backoff:
    """How often a camera ended lately.

    Attributes:
        failures: Since it last ran well.
    """

    failures: int = 0

    @property
    def wait_s(self) -> float:
        """Seconds until it is begun again.

        >>> [Backoff(n).wait_s for n in (1, 2, 3, 9)]
        [1.0, 2.0, 4.0, 60.0]
        """
        doubled = FIRST_WAIT_S * 2.0 ** min(self.failures - 1, 30)
        return min(LONGEST_WAIT_S, doubled) if self.failures else 0.0

    def after(self, ran_s: float) -> Backoff:
        """Once it has ended again.

        Args:
            ran_s: How long it had made steps, seconds.
        """
        return replace(self, failures=1 if ran_s >= CALM_S else self.failures + 1)

"""A clock with a sleep function, so that tests need not wait."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class WaitingClock:
    """The clock and sleep function of a waiter; injectable for tests.

    Attributes:
        now: Seconds from any start.
        wait: Sleeps for a number of seconds.
    """

    now: Callable[[], float] = time.monotonic
    wait: Callable[[float], None] = time.sleep

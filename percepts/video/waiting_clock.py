"""A clock that can be waited by, so that tests need not wait."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class WaitingClock:
    """By what something waits for its time; arguments for tests.

    Attributes:
        now: Seconds from any start.
        wait: Waits so many seconds.
    """

    now: Callable[[], float] = time.monotonic
    wait: Callable[[float], None] = time.sleep

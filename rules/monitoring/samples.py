"""For how long a sample speaks, how near two may be, and how an operator takes one in."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from visup.rules.formula.units import ticks
from visup.rules.monitoring.intervals import Interval

SAMPLE_HOLD = ticks(0.5)
"""How long one sample speaks for what follows, microseconds."""
MIN_SPACING = ticks(0.01)
"""Samples closer than this are not taken in, which bounds what a window holds; microseconds."""
LONG_AGO = -(2**62)

Update = Callable[..., tuple[Any, Any]]
"""(state before or None at the first sample, microseconds, intervals of the parts) -> (state after,
the interval of the whole)."""


def max_samples(span: int) -> int:
    """Most samples of a span in microseconds, with one for each silence and one at either end."""
    return span // MIN_SPACING + span // SAMPLE_HOLD + 2


SelectObjects = Callable[[Any, Interval], Any]
"""(intervals, what those of new objects are) -> intervals of the objects there are now."""

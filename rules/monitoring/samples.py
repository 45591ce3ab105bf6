"""Validity and spacing of samples, and the signatures of updates."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from visup.rules.formula.units import ticks
from visup.rules.monitoring.intervals import Interval

SAMPLE_HOLD = ticks(0.5)
"""Validity of a sample, microseconds."""
MIN_SPACING = ticks(0.01)
"""Samples closer than this are skipped, which bounds the content of a window; microseconds."""
LONG_AGO = -(2**62)

Update = Callable[..., tuple[Any, Any]]
"""(state before or None at the first sample, microseconds, intervals of the operands) -> (state after,
interval of the result)."""


def max_samples(span: int) -> int:
    """Most samples in a span, microseconds, with one for each gap and one at either end."""
    return span // MIN_SPACING + span // SAMPLE_HOLD + 2


SelectObjects = Callable[[Any, Interval], Any]
"""(intervals, interval of new objects) -> intervals of the current objects."""

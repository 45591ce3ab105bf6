"""Alerts about the supervisor itself rather than about the scene.

A run without a task also has a verdict: whether something unsafe was seen, and whether the scene could
be watched throughout.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from visup.agent.model.events import Alert, Event, Severity
from visup.agent.model.task_beliefs import Verdict

BEHAVIOUR_FAILED = "behaviour_failed"
CLOCK_JUMPED = "clock_jumped"
FRAMES_DROPPED = "frames_dropped"
NOT_RECORDED = "not_recorded"
REASONING_FAILED = "reasoning_failed"
SINK_FAILED = "sink_failed"
SOURCE_DROPPED = "source_dropped"

DELIVERY_ALERTS = frozenset({NOT_RECORDED, SINK_FAILED})
"""Alerts about recording and delivery, which say nothing about the scene."""

PERCEPTION_ALERTS = frozenset(
    {BEHAVIOUR_FAILED, CLOCK_JUMPED, FRAMES_DROPPED, REASONING_FAILED, SOURCE_DROPPED}
)
"""Alerts about frames that were not perceived or not reasoned about, so that the scene is unknown."""

SYSTEM_ALERTS = DELIVERY_ALERTS | PERCEPTION_ALERTS
"""All alerts about the supervisor itself; rules may not have these names."""


def grave_kinds(reported: Iterable[Event | Alert]) -> Iterator[str]:
    """Kinds of events or alerts of severity warning and above; for an `alert` event, that of its alert."""
    for record in reported:
        if record.severity >= Severity.WARNING:
            yield (
                str(record.data.get("alert_kind", record.kind))
                if isinstance(record, Event)
                else record.kind
            )


def verdict_without_task(kinds: Iterable[str], so_far: Verdict | None = None) -> Verdict | None:
    """The verdict on a run without a task.

    Args:
        kinds: Kinds of warnings and above (`grave_kinds`).
        so_far: The verdict before these.

    Returns:
        'interrupted' if something unsafe was seen, else 'unknown' if part of it was not watched, else None.
    """
    warnings = frozenset(kinds)
    if so_far is Verdict.INTERRUPTED or warnings - SYSTEM_ALERTS:
        return Verdict.INTERRUPTED
    return Verdict.UNKNOWN if warnings & PERCEPTION_ALERTS else so_far

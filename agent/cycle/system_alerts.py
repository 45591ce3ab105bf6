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

NOT_PASSED_ON = frozenset({NOT_RECORDED, SINK_FAILED})
"""Alerts about recording and delivery, which say nothing about the scene."""

NOT_WATCHED = frozenset(
    {BEHAVIOUR_FAILED, CLOCK_JUMPED, FRAMES_DROPPED, REASONING_FAILED, SOURCE_DROPPED}
)
"""Alerts about frames that were not perceived or not reasoned about, so that the scene is unknown."""

SYSTEM_ALERTS = NOT_PASSED_ON | NOT_WATCHED
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
    grave = frozenset(kinds)
    if so_far is Verdict.INTERRUPTED or grave - SYSTEM_ALERTS:
        return Verdict.INTERRUPTED
    return Verdict.UNKNOWN if grave & NOT_WATCHED else so_far

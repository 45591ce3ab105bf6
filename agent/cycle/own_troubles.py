"""What alerts say of the supervisor itself rather than of what it watches.

A run without a task has a verdict all the same: whether something grave was seen, and whether all was
watched.
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
"""Alerts about what was seen and told, but not written or delivered: they say nothing of what was seen."""

NOT_WATCHED = frozenset(
    {BEHAVIOUR_FAILED, CLOCK_JUMPED, FRAMES_DROPPED, REASONING_FAILED, SOURCE_DROPPED}
)
"""Alerts about a part that was not perceived, or not reasoned about: nobody knows what was there."""

OWN_TROUBLES = NOT_PASSED_ON | NOT_WATCHED
"""Kinds of alert that no rule may bear."""


def grave_kinds(reported: Iterable[Event | Alert]) -> Iterator[str]:
    """The kinds of those events or alerts that a person should look at; that of the alert for its event."""
    for it in reported:
        if it.severity >= Severity.WARNING:
            yield str(it.data.get("alert_kind", it.kind)) if isinstance(it, Event) else it.kind


def verdict_without_task(kinds: Iterable[str], so_far: Verdict | None = None) -> Verdict | None:
    """What a run without a task comes to.

    Args:
        kinds: Of what a person should look at (`grave_kinds`).
        so_far: What came of it before these.

    Returns:
        'interrupted' when something grave was seen, else 'unknown' when a part was not watched, else None.
    """
    grave = frozenset(kinds)
    if so_far is Verdict.INTERRUPTED or grave - OWN_TROUBLES:
        return Verdict.INTERRUPTED
    return Verdict.UNKNOWN if grave & NOT_WATCHED else so_far

"""The sinks of a run, from its options."""

from __future__ import annotations

from visup.agent.storage.wall_clock import RecordStamp
from visup.runs.settings import RunOptions
from visup.sinks import Sinks
from visup.sinks.webhook_access import WebhookAccess


def sinks_of(options: RunOptions, source: str, stamp: RecordStamp) -> Sinks:
    """All sinks that a run sends alerts to.

    Args:
        options: Of the run.
        source: What is watched.
        stamp: What stands in every record besides what it tells.

    Raises:
        VisupError: One cannot be opened.
    """
    access = WebhookAccess(options.webhook_headers, options.webhook_key)
    return Sinks(options.sinks, source, options.closing_s, stamp, access)

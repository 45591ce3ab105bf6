"""The sinks of a run, from its options."""

from __future__ import annotations

from visup.agent.storage.wall_clock import RecordStamp
from visup.runs.settings import RunOptions
from visup.runs.unattended.quiet_hours import QuietGate, QuietHours
from visup.sinks import Sinks
from visup.sinks.delivery_log import DeliveryLog
from visup.sinks.webhook_access import WebhookAccess


def sinks_of(
    options: RunOptions, source: str, stamp: RecordStamp, resumed_at: float | None = None
) -> Sinks:
    """The sinks for the alerts of a run.

    Args:
        options: Options of the run.
        source: The source.
        stamp: Common fields of all records.
        resumed_at: When the run was last written to, seconds since 1970; None for a new run.

    Raises:
        VisupError: One cannot be opened.
    """
    access = WebhookAccess(options.webhook_headers, options.webhook_key)
    log = DeliveryLog(options.deliveries) if options.deliveries else None
    if log and resumed_at is None:
        log.begin()
    sinks = Sinks(options.sinks, source, options.closing_s, stamp, access, log)
    if options.quiet:
        hours = QuietHours.read(options.quiet, options.timezone)
        sinks.alerts.gate = QuietGate(hours, lambda time_s: stamp.clock.seconds(time_s), resumed_at)
    return sinks

"""Sinks: alerts and figures for other programs, outside of the cycle.

Read `outbox.py` (how nothing waits for a sink), then `plain.py`, and `choose.py` (what `--sink` means).
"""

from visup.sinks.choose import Sinks, open_sink
from visup.sinks.outbox import Outbox, Sink
from visup.sinks.records import AlertSender

__all__ = ["AlertSender", "Outbox", "Sink", "Sinks", "open_sink"]

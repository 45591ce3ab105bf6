"""Sinks: alerts and metrics for other programs, outside the cycle.

Read `outbox.py` (how nothing waits for a sink), `insistent_outbox.py` with `delivery_log.py` (how nothing is
lost where a service watches), then `lines.py` (files), `webhook.py`, and
`registry.py` (what `--sink` means).
"""

from visup.sinks.messages import AlertSender
from visup.sinks.outbox import Outbox, Sink
from visup.sinks.registry import Sinks, open_sink

__all__ = ["AlertSender", "Outbox", "Sink", "Sinks", "open_sink"]

"""Sinks: alerts and metrics for other programs, outside the cycle.

Read `outbox.py` (asynchronous delivery), `durable_outbox.py` with `delivery_log.py` (reliable delivery for
services), then `lines.py` (files), `webhook.py`, and `registry.py` (parses `--sink`).
"""

from visup.sinks.messages import AlertSender
from visup.sinks.outbox import Outbox, Sink
from visup.sinks.registry import Sinks, open_sink

__all__ = ["AlertSender", "Outbox", "Sink", "Sinks", "open_sink"]

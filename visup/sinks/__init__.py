"""Sinks: alerts and figures for other programs, outside of the cycle.

Read `outbox.py` (how nothing waits for a sink), then `builtin.py` (what needs only Python), and
`sinks.py` (what `--sink` means).
"""

from visup.sinks.messages import AlertSender
from visup.sinks.outbox import Outbox, Sink
from visup.sinks.sinks import Sinks, open_sink

__all__ = ["AlertSender", "Outbox", "Sink", "Sinks", "open_sink"]

"""The records for alert sinks: one for each alert that opens or closes, and one for the verdict."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from visup.agent import Alert, Frame, Verdict
from visup.agent.model.step import Step
from visup.agent.storage.jsonable import to_jsonable
from visup.agent.storage.wall_clock import RecordStamp
from visup.redaction import redacted
from visup.sinks.delivery_log import DeliveryLog
from visup.sinks.durable_outbox import DurableOutbox
from visup.sinks.outbox import Outbox

VERSION = 1


def alert_record(alert: Alert, source: str) -> dict[str, Any]:
    """The record of an alert (docs/formats.md)."""
    state = "opened" if alert.closed is None else "closed"
    return {
        "version": VERSION,
        "record": "alert",
        "state": state,
        "source": source,
        **to_jsonable(alert),
    }


def verdict_record(verdict: Verdict | None, steps: int, source: str) -> dict[str, Any]:
    """The record of the end of a run."""
    verdict_text = verdict.value if verdict else None
    return {
        "version": VERSION,
        "record": "verdict",
        "source": source,
        "verdict": verdict_text,
        "steps": steps,
    }


class AlertSender:
    """An observer that puts records of alerts into outboxes.

    Args:
        outboxes: Outboxes of the sinks.
        source: The source.
        stamp: Common fields of all records: camera, host, wall-clock time.
        log: The persistent queue for reliable delivery, or None.

    Attributes:
        links: Returns links to the evidence of an alert, by keys of its record.
        gate: Selects the alerts of a step that are sent now.
    """

    def __init__(
        self,
        outboxes: Sequence[Outbox | DurableOutbox],
        source: str,
        stamp: RecordStamp | None = None,
        log: DeliveryLog | None = None,
    ) -> None:
        self._outboxes, self._log = outboxes, log
        self._stamp = stamp or RecordStamp()
        self._source = redacted(source)
        self.links: Callable[[Alert], Mapping[str, str]] = lambda alert: {}
        self.gate: Callable[[Step], Sequence[Alert]] = lambda step: step.alerts

    def __call__(self, step: Step, frame: Frame) -> None:
        """Send the alerts that a step opened or closed."""
        records = [self._record_of(alert) for alert in self.gate(step)]
        if records or step.alerts:
            self._send(records, step.frame_index)

    def send_missed(self, step: Step) -> None:
        """Send the records of a step that an earlier process recorded but did not send."""
        if self._log and step.alerts and step.frame_index > self._log.last_frame:
            records = [self._record_of(alert) for alert in self.gate(step)]
            self._send(records, step.frame_index)

    def notice(self, text: str) -> None:
        """Send a sentence that cannot wait for a step."""
        record = {"version": VERSION, "record": "notice", "source": self._source, "text": text}
        self._send([{**record, **self._stamp.of(None)}])

    def end(self, verdict: Verdict | None, steps: int) -> None:
        """Send the verdict."""
        self._send([{**verdict_record(verdict, steps, self._source), **self._stamp.of(None)}])

    def _record_of(self, alert: Alert) -> dict[str, Any]:
        when = alert.opened if alert.closed is None else alert.closed
        record = {**alert_record(alert, self._source), **self.links(alert)}
        return {**record, **self._stamp.of(when)}

    def _send(self, records: Sequence[dict[str, Any]], frame_index: int | None = None) -> None:
        if self._log:
            records = [self._log.labelled(record) for record in records]
            if self._stored(self._log, records, frame_index):
                return
        for outbox in self._outboxes:
            for record in records:
                outbox.offer(record)

    def _stored(
        self, log: DeliveryLog, records: Sequence[dict[str, Any]], frame_index: int | None
    ) -> bool:
        """Store records in the log; returns False if it cannot be written, and they are sent without it."""
        durable = [o for o in self._outboxes if isinstance(o, DurableOutbox)]
        try:
            lost = log.add([o.key for o in durable], records, frame_index)
        except sqlite3.Error:
            return False
        for outbox in durable:
            outbox.dropped += lost
            outbox.wake()
        return True

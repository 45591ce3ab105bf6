"""What sinks for alerts are told: one record for each alert that opens or closes, and the verdict."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from visup.agent import Alert, Frame, Verdict
from visup.agent.model.step import Step
from visup.agent.storage.jsonable import to_jsonable
from visup.agent.storage.wall_clock import RecordStamp
from visup.redaction import redacted
from visup.sinks.outbox import Outbox

VERSION = 1


def alert_record(alert: Alert, source: str) -> dict[str, Any]:
    """An alert as it goes to other programs (docs/formats.md)."""
    state = "opened" if alert.closed is None else "closed"
    return {
        "version": VERSION,
        "record": "alert",
        "state": state,
        "source": source,
        **to_jsonable(alert),
    }


def verdict_record(verdict: Verdict | None, steps: int, source: str) -> dict[str, Any]:
    """The end of a run."""
    told = verdict.value if verdict else None
    return {
        "version": VERSION,
        "record": "verdict",
        "source": source,
        "verdict": told,
        "steps": steps,
    }


class AlertSender:
    """An observer that leaves records of alerts in outboxes.

    Args:
        outboxes: Of the sinks.
        source: What is watched.
        stamp: What else stands in every record: camera, host, time of the wall.

    Attributes:
        links: Tells where the evidence of an alert is, by keys of its record.
        gate: Tells which alerts of a step are sent now.
    """

    def __init__(
        self, outboxes: Sequence[Outbox], source: str, stamp: RecordStamp | None = None
    ) -> None:
        self._outboxes = outboxes
        self._stamp = stamp or RecordStamp()
        self._source = redacted(source)
        self.links: Callable[[Alert], Mapping[str, str]] = lambda alert: {}
        self.gate: Callable[[Step], Sequence[Alert]] = lambda step: step.alerts

    def __call__(self, step: Step, frame: Frame) -> None:
        """Send the alerts that a step opened or closed."""
        for alert in self.gate(step):
            when = alert.opened if alert.closed is None else alert.closed
            self._send({**alert_record(alert, self._source), **self.links(alert)}, when)

    def notice(self, text: str) -> None:
        """Send a sentence that cannot wait for a step."""
        told = {"version": VERSION, "record": "notice", "source": self._source, "text": text}
        self._send(told)

    def end(self, verdict: Verdict | None, steps: int) -> None:
        """Send the verdict."""
        self._send(verdict_record(verdict, steps, self._source))

    def _send(self, record: dict[str, Any], when: float | None = None) -> None:
        stamped = {**record, **self._stamp.of(when)}
        for outbox in self._outboxes:
            outbox.offer(stamped)

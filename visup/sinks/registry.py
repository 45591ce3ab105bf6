"""Parses `--sink`, and serves all sinks of a run as one observer."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

from visup.agent import AlertCondition, Frame, Verdict
from visup.agent.model.errors import SettingsError
from visup.agent.model.step import Observer, Step
from visup.agent.storage.wall_clock import RecordStamp
from visup.redaction import redacted
from visup.sinks.delivery_log import DeliveryLog
from visup.sinks.durable_outbox import DurableOutbox
from visup.sinks.lines import to_file, to_stdout
from visup.sinks.messages import AlertSender
from visup.sinks.outbox import CLOSING_S, MAX_WAITING, Outbox, Sink
from visup.sinks.webhook_access import WebhookAccess

MAX_STEPS = 64
"""Maximum number of whole steps with frames in a queue: some tens of megabytes."""

KINDS = (
    "jsonl:-, file:PATH, webhook:URL, mqtt:HOST[:PORT]/TOPIC, notify:ADDRESS, otel:console, otel:otlp, "
    "rerun:FILE"
)


def open_sink(spec: str, access: WebhookAccess | None = None) -> Sink:
    """Open a sink.

    Args:
        spec: `KIND:PLACE`, one of `KINDS`.
        access: Authentication of webhooks.

    Raises:
        SettingsError: There is no such kind, or the place is not valid.
        ExtraMissingError: It needs an extra that is not installed.
        OutputError: Its file cannot be written.
    """
    kind, colon, target = spec.partition(":")
    if not (colon and target and kind in (*_FACTORIES, "webhook")):
        shown = f"{kind}{colon}{redacted(target)}"
        raise SettingsError(f"--sink {shown!r} cannot be read", expected=f"one of: {KINDS}")
    if kind == "webhook":
        from visup.sinks.webhook import Webhook

        return Webhook(target, access=access)
    return _FACTORIES[kind](spec, target)


class Sinks:
    """All sinks of a run, as one observer.

    Args:
        specs: As in `--sink`.
        source: The source.
        closing_s: Time limit for delivering remaining records at the end, seconds.
        stamp: Common fields of the records of alerts.
        access: Authentication of webhooks.
        log: The persistent queue of alerts; None to drop undelivered ones.

    Attributes:
        outboxes: One per sink.
        alerts: Puts records of alerts into them.
    """

    def __init__(
        self,
        specs: Sequence[str],
        source: str,
        closing_s: float = CLOSING_S,
        stamp: RecordStamp | None = None,
        access: WebhookAccess | None = None,
        log: DeliveryLog | None = None,
    ) -> None:
        self._closing_s, self._log = closing_s, log
        opened = [open_sink(w, access) for w in specs]
        self.outboxes = [_outbox(s, n, log) for n, s in enumerate(opened)]
        self._alert_outboxes = [o for o in self.outboxes if _kind(o) not in _STEP_SINKS]
        self.alerts = AlertSender(self._alert_outboxes, source, stamp, log)
        self._observers: list[Observer] = [
            _sender(o, _STEP_SINKS[_kind(o)]) for o in self.outboxes if _kind(o) in _STEP_SINKS
        ]

    def __call__(self, step: Step, frame: Frame) -> None:
        """Put the records of a step into the outboxes."""
        self.alerts(step, frame)
        for observer in self._observers:
            observer(step, frame)

    def notice(self, text: str) -> None:
        """Send a sentence that cannot wait for a step."""
        self.alerts.notice(text)

    def runtime_faults(self) -> Iterable[AlertCondition]:
        """Present faults of the sinks."""
        return [condition for outbox in self.outboxes for condition in outbox.runtime_faults()]

    def end(self, verdict: Verdict | None, steps: int) -> tuple[str, ...]:
        """Send the verdict, close everything, and return notes about undelivered records."""
        self.alerts.end(verdict, steps)
        self.close()
        return tuple(o.note for o in self.outboxes if o.note)

    @property
    def delivered(self) -> bool:
        """Whether every alert sink accepted all records; sinks of whole steps may miss some."""
        return not any(o.note for o in self._alert_outboxes)

    def close(self) -> None:
        """Close all sinks; idempotent."""
        durable = [o for o in self.outboxes if isinstance(o, DurableOutbox)]
        for pending in durable:
            pending.start_closing()  # start all together, to share the time limit
        until = time.monotonic() + self._closing_s
        for outbox in self.outboxes:
            left = max(0.05, until - time.monotonic()) if outbox in durable else self._closing_s
            outbox.close(left)
        if self._log:
            self._log.close()
            self._log = None


def _jsonl(spec: str, target: str) -> Sink:
    if target != "-":
        raise SettingsError(f"--sink {spec!r} cannot be read", expected="jsonl:- or file:PATH")
    return to_stdout()


def _mqtt(spec: str, target: str) -> Sink:
    from visup.sinks.mqtt import Mqtt

    return Mqtt(target)


def _otel(spec: str, target: str) -> Sink:
    from visup.sinks.telemetry import Telemetry

    return Telemetry(target)


def _notification(spec: str, target: str) -> Sink:
    from visup.sinks.notification import Notification

    return Notification(target)


def _rerun(spec: str, target: str) -> Sink:
    from visup.sinks.rerun import Rerun

    return Rerun(target)


_FACTORIES: dict[str, Callable[[str, str], Sink]] = {
    "jsonl": _jsonl,
    "file": lambda wanted, place: to_file(wanted, Path(place)),
    "mqtt": _mqtt,
    "notify": _notification,
    "otel": _otel,
    "rerun": _rerun,
}
_STEP_SINKS: dict[str, Callable[[Step, Frame], object]] = {
    "otel": lambda step, frame: step,
    "rerun": lambda step, frame: (step, frame),
}


def _outbox(sink: Sink, number: int, log: DeliveryLog | None) -> Outbox | DurableOutbox:
    """The name of an outbox, made unique by its position if two sinks have the same."""
    if log is None or sink.name.partition(":")[0] in _STEP_SINKS:
        return Outbox(sink, _queue_length(sink))
    return DurableOutbox(sink, f"{number} {sink.name}", log)


def _kind(outbox: Outbox | DurableOutbox) -> str:
    return outbox.sink.name.partition(":")[0]


def _queue_length(sink: Sink) -> int:
    return MAX_STEPS if sink.name.partition(":")[0] in _STEP_SINKS else MAX_WAITING


def _sender(outbox: Outbox | DurableOutbox, record_of: Callable[[Step, Frame], object]) -> Observer:
    def send(step: Step, frame: Frame) -> None:
        outbox.offer(record_of(step, frame))

    return send

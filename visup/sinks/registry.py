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
from visup.sinks.insistent_outbox import InsistentOutbox
from visup.sinks.lines import to_file, to_stdout
from visup.sinks.messages import AlertSender
from visup.sinks.outbox import CLOSING_S, MOST_WAITING, Outbox, Sink
from visup.sinks.webhook_access import WebhookAccess

MOST_STEPS = 64
"""Maximum number of whole steps with frames in a queue: some tens of megabytes."""

KINDS = (
    "jsonl:-, file:PATH, webhook:URL, mqtt:HOST[:PORT]/TOPIC, notify:ADDRESS, otel:console, otel:otlp, "
    "rerun:FILE"
)


def open_sink(wanted: str, access: WebhookAccess | None = None) -> Sink:
    """Open a sink.

    Args:
        wanted: `KIND:PLACE`, one of `KINDS`.
        access: Authentication of webhooks.

    Raises:
        SettingsError: There is no such kind, or the place is not valid.
        ExtraMissingError: It needs an extra that is not installed.
        OutputError: Its file cannot be written.
    """
    kind, colon, place = wanted.partition(":")
    if not (colon and place and kind in (*_MAKERS, "webhook")):
        shown = f"{kind}{colon}{redacted(place)}"
        raise SettingsError(f"--sink {shown!r} cannot be read", expected=f"one of: {KINDS}")
    if kind == "webhook":
        from visup.sinks.webhook import Webhook

        return Webhook(place, access=access)
    return _MAKERS[kind](wanted, place)


class Sinks:
    """All sinks of a run, as one observer.

    Args:
        wanted: As in `--sink`.
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
        wanted: Sequence[str],
        source: str,
        closing_s: float = CLOSING_S,
        stamp: RecordStamp | None = None,
        access: WebhookAccess | None = None,
        log: DeliveryLog | None = None,
    ) -> None:
        self._closing_s, self._log = closing_s, log
        made = [open_sink(w, access) for w in wanted]
        self.outboxes = [_outbox(s, n, log) for n, s in enumerate(made)]
        self._of_alerts = [o for o in self.outboxes if _kind(o) not in _OF_STEPS]
        self.alerts = AlertSender(self._of_alerts, source, stamp, log)
        self._observers: list[Observer] = [
            _sender(o, _OF_STEPS[_kind(o)]) for o in self.outboxes if _kind(o) in _OF_STEPS
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
        return [concern for outbox in self.outboxes for concern in outbox.runtime_faults()]

    def end(self, verdict: Verdict | None, steps: int) -> tuple[str, ...]:
        """Send the verdict, close everything, and return notes about undelivered records."""
        self.alerts.end(verdict, steps)
        self.close()
        return tuple(o.note for o in self.outboxes if o.note)

    @property
    def delivered(self) -> bool:
        """Whether every alert sink accepted all records; sinks of whole steps may miss some."""
        return not any(o.note for o in self._of_alerts)

    def close(self) -> None:
        """Close all sinks; idempotent."""
        insistent = [o for o in self.outboxes if isinstance(o, InsistentOutbox)]
        for outbox in insistent:
            outbox.begin_closing()  # start all together, to share the time limit
        until = time.monotonic() + self._closing_s
        for each in self.outboxes:
            left = max(0.05, until - time.monotonic()) if each in insistent else self._closing_s
            each.close(left)
        if self._log:
            self._log.close()
            self._log = None


def _jsonl(wanted: str, place: str) -> Sink:
    if place != "-":
        raise SettingsError(f"--sink {wanted!r} cannot be read", expected="jsonl:- or file:PATH")
    return to_stdout()


def _mqtt(wanted: str, place: str) -> Sink:
    from visup.sinks.mqtt import Mqtt

    return Mqtt(place)


def _otel(wanted: str, place: str) -> Sink:
    from visup.sinks.telemetry import Telemetry

    return Telemetry(place)


def _notification(wanted: str, place: str) -> Sink:
    from visup.sinks.notification import Notification

    return Notification(place)


def _rerun(wanted: str, place: str) -> Sink:
    from visup.sinks.rerun import Rerun

    return Rerun(place)


_MAKERS: dict[str, Callable[[str, str], Sink]] = {
    "jsonl": _jsonl,
    "file": lambda wanted, place: to_file(wanted, Path(place)),
    "mqtt": _mqtt,
    "notify": _notification,
    "otel": _otel,
    "rerun": _rerun,
}
_OF_STEPS: dict[str, Callable[[Step, Frame], object]] = {
    "otel": lambda step, frame: step,
    "rerun": lambda step, frame: (step, frame),
}


def _outbox(sink: Sink, number: int, log: DeliveryLog | None) -> Outbox | InsistentOutbox:
    """The name of an outbox, made unique by its position if two sinks have the same."""
    if log is None or sink.name.partition(":")[0] in _OF_STEPS:
        return Outbox(sink, _room(sink))
    return InsistentOutbox(sink, f"{number} {sink.name}", log)


def _kind(outbox: Outbox | InsistentOutbox) -> str:
    return outbox.sink.name.partition(":")[0]


def _room(sink: Sink) -> int:
    return MOST_STEPS if sink.name.partition(":")[0] in _OF_STEPS else MOST_WAITING


def _sender(outbox: Outbox | InsistentOutbox, of: Callable[[Step, Frame], object]) -> Observer:
    def send(step: Step, frame: Frame) -> None:
        outbox.offer(of(step, frame))

    return send

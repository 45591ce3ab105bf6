"""A bounded queue between the cycle and a sink, with a thread that empties it.

The cycle never waits. If a sink is too slow, new records are dropped, counted and reported as an alert. A
sink that fails is tried again with the next record.
"""

from __future__ import annotations

import threading
from collections.abc import Iterable
from queue import Empty, Full, Queue
from typing import Any, Protocol

from visup.agent import AlertCondition, Severity
from visup.agent.cycle.system_alerts import SINK_FAILED

MAX_WAITING = 1000
CLOSING_S = 5.0


class Sink(Protocol):
    """A destination of records. Its methods run in a separate thread, and may block and raise."""

    name: str

    def deliver(self, record: Any) -> None:
        """Send one record."""
        ...

    def close(self) -> None:
        """Close files and connections."""
        ...


class Outbox:
    """The queue and the thread of one sink.

    Args:
        sink: The sink.
        most: Maximum length of the queue.

    Attributes:
        sink: As given.
        delivered: Number of delivered records.
        dropped: Number of records dropped because the queue was full.
        failed: Number of records that could not be delivered.
        fault: Why the last one was not delivered; empty if it was.
    """

    def __init__(self, sink: Sink, max_length: int = MAX_WAITING) -> None:
        self.sink = sink
        self.delivered = self.dropped = self.failed = 0
        self.fault = ""
        self._queue: Queue[Any] = Queue(max_length)
        self._closing = threading.Event()
        self._abandoned = threading.Event()
        self._queued = 0
        self._thread = threading.Thread(target=self._run, name=f"sink {sink.name}", daemon=True)
        self._thread.start()

    def offer(self, record: Any) -> None:
        """Queue a record; returns at once."""
        try:
            self._queue.put_nowait(record)
        except Full:
            self.dropped += 1
        else:
            self._queued += 1

    def close(self, wait_s: float = CLOSING_S) -> None:
        """Wait a last time for the queue to empty; remaining records are dropped."""
        self._closing.set()
        self._thread.join(wait_s)
        if self._thread.is_alive() and not self._abandoned.is_set():
            # First stop the thread from taking more; the record in progress may or may not be delivered.
            self._abandoned.set()
            self.dropped += self._queued - self.delivered - self.failed
            self.fault = self.fault or "it did not answer in time"

    @property
    def note(self) -> str | None:
        """A note for the user at the end, or None if all was delivered."""
        return not_delivered(self.sink.name, self.failed, self.dropped, self.fault)

    def runtime_faults(self) -> Iterable[AlertCondition]:
        """Present faults of the sink."""
        yield from sink_fault(self.sink.name, self.fault, self.dropped)

    def _run(self) -> None:
        while not self._abandoned.is_set():
            try:
                record = self._queue.get(timeout=0.1)
            except Empty:
                if self._closing.is_set():
                    break
                continue
            self._in_hand = 1
            self._deliver(record)
        try:
            self.sink.close()
        except Exception as fault:
            self.fault = f"{type(fault).__name__}: {fault}"

    def _deliver(self, record: Any) -> None:
        try:
            self.sink.deliver(record)
        except Exception as fault:
            # Any exception is a failure of the sink, never of the supervisor.
            self.failed += 1
            self.fault = f"{type(fault).__name__}: {fault}"
        else:
            self.delivered += 1
            self.fault = ""


def not_delivered(name: str, failed: int, dropped: int, fault: str) -> str | None:
    """A note about a sink for the user at the end, or None if all was delivered."""
    if not (dropped or failed):
        return None
    why = f": {fault}" if fault else ""
    return f"Not all could be delivered to the sink {name}: {failed} failed, {dropped} dropped{why}"


def sink_fault(name: str, fault: str, dropped: int) -> Iterable[AlertCondition]:
    """The alert condition of a sink while it does not accept all records."""
    if fault or dropped:
        yield AlertCondition(
            SINK_FAILED,
            (),
            Severity.WARNING,
            f"The sink '{name}' does not accept everything that is sent to it.",
            tuple(part for part in (fault, _dropped(dropped)) if part),
            key=name,
            needs=(),
        )


def _dropped(count: int) -> str:
    return f"{count} records were dropped." if count else ""

"""An outbox with reliable delivery: records are retried, by the next process if necessary."""

from __future__ import annotations

import sqlite3
import threading
from collections import deque
from collections.abc import Iterable
from typing import Any

from visup.agent import AlertCondition
from visup.sinks.delivery_log import DeliveryLog
from visup.sinks.outbox import CLOSING_S, Sink, not_delivered, sink_fault

INITIAL_WAIT_S = 1.0
MAX_WAIT_S = 30.0
POLL_S = 0.5


class DurableOutbox:
    """Sends pending records to one sink, oldest first, in its own thread.

    A sink that is down is retried after 1 s, then 2, 4, ... up to 30. A record that it finally refuses is
    counted and skipped, so that it does not block the others.

    Args:
        sink: The sink.
        key: Key of its records.
        log: The persistent queue.

    Attributes:
        sink: As given.
        key: As given.
        delivered: Number of delivered records.
        dropped: Number of records lost because too many were waiting.
        failed: Number of refused records.
        fault: Why the last one was not delivered; empty if it was.
    """

    def __init__(self, sink: Sink, key: str, log: DeliveryLog) -> None:
        self.sink, self.key = sink, key
        self.delivered = self.dropped = self.failed = 0
        self.fault = ""
        self._log = log
        self._unstored: deque[Any] = deque(maxlen=1000)
        self._new, self._closing = threading.Event(), threading.Event()
        self._closed = False
        self._sent: int | None = None
        self._thread = threading.Thread(target=self._run, name=f"sink {sink.name}", daemon=True)
        self._thread.start()

    def wake(self) -> None:
        """Wake the thread to send."""
        self._new.set()

    def offer(self, record: Any) -> None:
        """Send a record that could not be stored, within this process; returns at once."""
        self.dropped += len(self._unstored) == self._unstored.maxlen
        self._unstored.append(record)
        self.wake()

    def start_closing(self) -> None:
        """Send the pending records without further retries; returns at once."""
        self._closing.set()
        self._new.set()

    def close(self, wait_s: float = CLOSING_S) -> None:
        """Wait a last time for the sink; remaining records wait for the next process."""
        self.start_closing()
        self._thread.join(wait_s)
        self._closed = True

    @property
    def note(self) -> str | None:
        """A note for the user at the end, or None if all was delivered."""
        return not_delivered(self.sink.name, self.failed, self.dropped, self.fault)

    def runtime_faults(self) -> Iterable[AlertCondition]:
        """Present faults of the sink."""
        yield from sink_fault(self.sink.name, self.fault, self.dropped)

    def _run(self) -> None:
        wait_s = INITIAL_WAIT_S
        while not self._closed:
            sent = self._send_oldest()
            if sent:
                wait_s = INITIAL_WAIT_S
            elif self._closing.is_set():
                break
            elif sent is None:
                self._new.wait(POLL_S)
                self._new.clear()
            else:
                self._closing.wait(wait_s)
                wait_s = min(2.0 * wait_s, MAX_WAIT_S)
        try:
            self.sink.close()
        except Exception as fault:
            self.fault = f"{type(fault).__name__}: {fault}"

    def _send_oldest(self) -> bool | None:
        """Whether the oldest record is dealt with; None if there is none."""
        try:
            found = self._log.oldest(self.key)
        except (sqlite3.Error, ValueError) as fault:
            self.fault = f"{type(fault).__name__}: {fault}"
            found = None
        if found is None and not self._unstored:
            return None
        number, record = found or (None, self._unstored[0])
        # A record that was sent but could not be removed is not sent again.
        finished = (number is not None and number == self._sent) or self._delivered(record)
        if finished and number is None:
            self._unstored.popleft()
        elif finished and number is not None:
            self._sent = number
            try:
                self._log.done(number)
            except sqlite3.Error as fault:
                self.fault = f"{type(fault).__name__}: {fault}"
                return False
        return finished

    def _delivered(self, record: Any) -> bool:
        """Whether the sink accepted a record, or finally refused it."""
        try:
            self.sink.deliver(record)
        except Exception as fault:
            self.fault = f"{type(fault).__name__}: {fault}"
            final = bool(getattr(fault, "final", False))
            self.failed += final
            return final
        self.delivered += 1
        self.fault = ""
        return True

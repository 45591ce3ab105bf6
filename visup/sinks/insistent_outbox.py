"""An outbox that does not give up: what a sink did not take is sent again, by the next process if need be."""

from __future__ import annotations

import sqlite3
import threading
from collections import deque
from collections.abc import Iterable
from typing import Any

from visup.agent import AlertCondition
from visup.sinks.delivery_log import DeliveryLog
from visup.sinks.outbox import CLOSING_S, Sink, not_delivered, sink_fault

FIRST_WAIT_S = 1.0
LONGEST_WAIT_S = 30.0
LOOK_S = 0.5


class InsistentOutbox:
    """Sends pending records to one sink, oldest first, in its own thread.

    A sink that is down is tried again after 1 s, then 2, 4, ... up to 30. A record that it refuses for good
    is counted and left out: it must not hold up all others.

    Args:
        sink: Where the records go.
        key: Under which they wait.
        log: Where they wait.

    Attributes:
        sink: As given.
        key: As given.
        delivered: Records that the sink took.
        dropped: Records that were lost, since too many waited.
        failed: Records that the sink refused.
        fault: Why the last one was not delivered; empty when it was.
    """

    def __init__(self, sink: Sink, key: str, log: DeliveryLog) -> None:
        self.sink, self.key = sink, key
        self.delivered = self.dropped = self.failed = 0
        self.fault = ""
        self._log = log
        self._unwritten: deque[Any] = deque(maxlen=1000)
        self._new, self._closing = threading.Event(), threading.Event()
        self._over = False
        self._sent: int | None = None
        self._thread = threading.Thread(target=self._run, name=f"sink {sink.name}", daemon=True)
        self._thread.start()

    def wake(self) -> None:
        """There is something to send."""
        self._new.set()

    def offer(self, record: Any) -> None:
        """Send what could not be noted, as long as this process lives; returns at once."""
        self.dropped += len(self._unwritten) == self._unwritten.maxlen
        self._unwritten.append(record)
        self.wake()

    def begin_closing(self) -> None:
        """Send what can be sent at once, and no more; returns at once."""
        self._closing.set()
        self._new.set()

    def close(self, wait_s: float = CLOSING_S) -> None:
        """Give the sink a last time; what it has not taken then waits for the next process."""
        self.begin_closing()
        self._thread.join(wait_s)
        self._over = True

    @property
    def note(self) -> str | None:
        """What the user should know at the end, or None when all was delivered."""
        return not_delivered(self.sink.name, self.failed, self.dropped, self.fault)

    def runtime_faults(self) -> Iterable[AlertCondition]:
        """What is wrong with the sink now."""
        yield from sink_fault(self.sink.name, self.fault, self.dropped)

    def _run(self) -> None:
        wait_s = FIRST_WAIT_S
        while not self._over:
            taken = self._send_oldest()
            if taken:
                wait_s = FIRST_WAIT_S
            elif self._closing.is_set():
                break
            elif taken is None:
                self._new.wait(LOOK_S)
                self._new.clear()
            else:
                self._closing.wait(wait_s)
                wait_s = min(2.0 * wait_s, LONGEST_WAIT_S)
        try:
            self.sink.close()
        except Exception as fault:
            self.fault = f"{type(fault).__name__}: {fault}"

    def _send_oldest(self) -> bool | None:
        """Whether it is dealt with; None when there is none."""
        try:
            found = self._log.oldest(self.key)
        except (sqlite3.Error, ValueError) as fault:
            self.fault = f"{type(fault).__name__}: {fault}"
            found = None
        if found is None and not self._unwritten:
            return None
        number, record = found or (None, self._unwritten[0])
        # One that was sent and could not be crossed off is not sent again.
        dealt_with = (number is not None and number == self._sent) or self._delivered(record)
        if dealt_with and number is None:
            self._unwritten.popleft()
        elif dealt_with and number is not None:
            self._sent = number
            try:
                self._log.done(number)
            except sqlite3.Error as fault:
                self.fault = f"{type(fault).__name__}: {fault}"
                return False
        return dealt_with

    def _delivered(self, record: Any) -> bool:
        """Whether the sink took a record, or will never take it."""
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

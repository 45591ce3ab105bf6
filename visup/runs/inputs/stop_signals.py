"""Ctrl-C and a polite kill (SIGTERM, as service managers send it) end a run; they are never lost.

Python raises KeyboardInterrupt wherever the program happens to be. Inside what compiled code calls back it
is printed and dropped, and the run would go on; hence the request is remembered besides.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from types import FrameType

SIGNALS = (signal.SIGINT, signal.SIGTERM)


@dataclass(slots=True)
class StopRequest:
    """Whether a stop signal was received."""

    received: bool = False


@contextmanager
def stop_signals() -> Iterator[StopRequest]:
    """A stop signal raises KeyboardInterrupt here, and stays known.

    Only the main thread can receive signals; elsewhere nothing is changed. What is ignored stays so: a shell
    starts what runs in the background deaf to Ctrl-C.
    """
    request = StopRequest()

    def receive(number: int, frame: FrameType | None) -> None:
        request.received = True
        raise KeyboardInterrupt

    here = threading.current_thread() is threading.main_thread()
    heard = [n for n in SIGNALS if here and signal.getsignal(n) is not signal.SIG_IGN]
    before = {number: signal.signal(number, receive) for number in heard}
    try:
        yield request
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)

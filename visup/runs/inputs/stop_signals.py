"""Ctrl-C and a polite kill (SIGTERM, as service managers send it) end a run; they are never lost.

A service asks to be let finish its step (`at_once=False`), and hears by SIGHUP that its file has changed.

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
    """A request to stop or reload, from a signal.

    Attributes:
        received: A stop.
        reload: That settings are read again; whoever does so resets it.
        closing: Set by whoever closes the books: then no signal raises that was to wait for a step.
    """

    received: bool = False
    reload: bool = False
    closing: bool = False


@contextmanager
def stop_signals(*, at_once: bool = True, reload: bool = False) -> Iterator[StopRequest]:
    """A stop signal raises KeyboardInterrupt here, and stays known.

    Args:
        at_once: Raise at the first signal; else it is only noted, and the second one raises, for whoever
            waits for a frame that does not come.
        reload: Also note SIGHUP, where there is such a signal.

    Only the main thread can receive signals; elsewhere nothing is changed. What is ignored stays so: a shell
    starts what runs in the background deaf to Ctrl-C.
    """
    request = StopRequest()

    def receive(number: int, frame: FrameType | None) -> None:
        again, request.received = request.received, True
        if at_once or (again and not request.closing):
            raise KeyboardInterrupt

    def note_reload(number: int, frame: FrameType | None) -> None:
        request.reload = True

    here = threading.current_thread() is threading.main_thread()
    heard = [n for n in SIGNALS if here and signal.getsignal(n) is not signal.SIG_IGN]
    before = {number: signal.signal(number, receive) for number in heard}
    if here and reload and hasattr(signal, "SIGHUP"):
        before[signal.SIGHUP] = signal.signal(signal.SIGHUP, note_reload)
    try:
        yield request
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)

"""Stop signals: Ctrl-C and SIGTERM (sent by service managers) end a run and are never lost.

A service lets its step finish first (`at_once=False`), and reloads its file on SIGHUP.

Python raises KeyboardInterrupt at any point of the program. In a callback from compiled code it is printed
and dropped, and the run would go on; hence the request is stored, too.
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
        received: Whether a stop was requested.
        reload: Whether a reload was requested; reset by its handler.
        closing: Set while a run is closed: signals that wait for a step then do not raise.
    """

    received: bool = False
    reload: bool = False
    closing: bool = False


@contextmanager
def stop_signals(*, at_once: bool = True, reload: bool = False) -> Iterator[StopRequest]:
    """Make stop signals raise KeyboardInterrupt and record them.

    Args:
        at_once: Raise at the first signal; otherwise the first is only recorded and the second raises, in
            case the run waits for a frame that does not come.
        reload: Also record SIGHUP, where it exists.

    Only the main thread can receive signals; in others nothing is changed. Ignored signals stay ignored:
    shells start background jobs with SIGINT ignored.
    """
    request = StopRequest()

    def receive(number: int, frame: FrameType | None) -> None:
        again, request.received = request.received, True
        if at_once or (again and not request.closing):
            raise KeyboardInterrupt

    def note_reload(number: int, frame: FrameType | None) -> None:
        request.reload = True

    in_main_thread = threading.current_thread() is threading.main_thread()
    handled = [n for n in SIGNALS if in_main_thread and signal.getsignal(n) is not signal.SIG_IGN]
    before = {number: signal.signal(number, receive) for number in handled}
    if in_main_thread and reload and hasattr(signal, "SIGHUP"):
        before[signal.SIGHUP] = signal.signal(signal.SIGHUP, note_reload)
    try:
        yield request
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)

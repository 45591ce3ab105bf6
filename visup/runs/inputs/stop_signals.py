"""Ctrl-C and a polite kill (SIGTERM, as service managers send it) end a run; they are never lost.

Python raises KeyboardInterrupt wherever the program happens to be. Inside what compiled code calls back it
is printed and dropped, and the run would go on; hence the request is remembered besides.
"""

from __future__ import annotations

import signal
import threading
from types import FrameType, TracebackType
from typing import Self

SIGNALS = (signal.SIGINT, signal.SIGTERM)


class StopSignals:
    """While it is entered, a stop signal raises KeyboardInterrupt and stays known as `received`.

    Only the main thread can receive signals; elsewhere nothing is changed.
    """

    def __init__(self) -> None:
        self.received = False
        self._before: dict[signal.Signals, object] = {}

    def __enter__(self) -> Self:
        if threading.current_thread() is threading.main_thread():
            # What is ignored stays so: a shell starts what runs in the background deaf to Ctrl-C.
            heard = [n for n in SIGNALS if signal.getsignal(n) is not signal.SIG_IGN]
            self._before = {number: signal.signal(number, self._receive) for number in heard}
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)  # type: ignore[arg-type]

    def _receive(self, number: int, frame: FrameType | None) -> None:
        self.received = True
        raise KeyboardInterrupt

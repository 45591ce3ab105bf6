"""The service log: events of cameras as lines of text or as JSON records."""

from __future__ import annotations

import socket
import time
from collections.abc import Callable
from enum import StrEnum
from typing import Any, Protocol

from visup.agent.storage.wall_clock import utc_text
from visup.wording import escaped_json

SITE = "site"
"""Subject of messages that concern no single camera."""


class SiteEvent(StrEnum):
    """Kinds of events."""

    BEGUN = "begun"
    RESUMED = "resumed"
    ENDED = "ended"
    DIED = "died"
    HUNG = "hung"
    TOO_LARGE = "too_large"
    NOT_CLOSED = "not_closed"
    NOT_BEGUN = "not_begun"
    NOTICE = "notice"
    """A message of the camera process, such as that its stream dropped."""
    ROLLED = "rolled"
    RELOADED = "reloaded"
    NOT_RELOADED = "not_reloaded"
    MONITORED = "monitored"
    NOT_MONITORED = "not_monitored"
    DELETED = "deleted"
    NO_ROOM = "no_room"
    CONSOLE = "console"
    CONSOLE_ENDED = "console_ended"


_WARNINGS = frozenset(
    {
        SiteEvent.DIED,
        SiteEvent.HUNG,
        SiteEvent.TOO_LARGE,
        SiteEvent.NOT_CLOSED,
        SiteEvent.NOT_BEGUN,
        SiteEvent.NOTICE,
        SiteEvent.NOT_RELOADED,
        SiteEvent.NOT_MONITORED,
        SiteEvent.NO_ROOM,
        SiteEvent.CONSOLE_ENDED,
    }
)


class LogEvent(Protocol):
    """Receives the events of the service."""

    def __call__(
        self, camera: str, text: str, kind: SiteEvent = SiteEvent.NOTICE, /, **facts: Any
    ) -> None:
        """Pass an event on.

        Args:
            camera: Its name, or `SITE`.
            text: One sentence.
            kind: Kind of event.
            facts: Details for programs, such as `run` or `exit_code`.
        """


class SiteLog:
    """Writes one line for each event.

    Args:
        write: Receives a line.
        as_json: Whether lines are JSON objects.
        now: Seconds since 1970.
    """

    def __init__(
        self,
        write: Callable[[str], object],
        *,
        as_json: bool = False,
        now: Callable[[], float] = time.time,
    ) -> None:
        self._write, self._as_json, self._now = write, as_json, now
        self._host = socket.gethostname()

    def __call__(
        self, camera: str, text: str, kind: SiteEvent = SiteEvent.NOTICE, /, **facts: Any
    ) -> None:
        """Write one line."""
        time_text = utc_text(self._now())
        if not self._as_json:
            self._write(f"{time_text} {camera}: {text}")
            return
        level = "warning" if kind in _WARNINGS else "info"
        record = {"time": time_text, "level": level, "host": self._host, "camera": camera}
        self._write(escaped_json({**record, "kind": kind.value, "text": text, **facts}))

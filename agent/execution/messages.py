"""Messages between the supervisor and the process of an isolated behaviour: data, never code.

A message is a JSON document of bounded size, prefixed by its length. Reading and writing have deadlines, so
that neither a partial message nor a peer that does not read blocks the caller.
"""

from __future__ import annotations

import socket
import struct
import time
from collections.abc import Mapping
from typing import Any

from pydantic_core import from_json, to_json

from visup.agent.storage.text_file import check_room

LARGEST_BYTES = 256 * 2**20
"""Maximum size of a message, bytes; a larger one is refused unread."""

_LENGTH = struct.Struct("<Q")
_CHUNK = 2**20

Message = Mapping[str, Any]


class MessageError(Exception):
    """The received data are no message."""


class Channel:
    """One end of a connection, for use by one thread.

    Args:
        end: A connected stream socket; it is closed with the channel.
    """

    def __init__(self, end: socket.socket) -> None:
        self._end = end

    def send(self, message: Message, seconds: float | None = None) -> None:
        """Send a message within a time limit.

        Raises:
            TimeoutError: The other end does not read.
            OSError: It is closed.
            ValueError: The message is too large, or is not JSON.
        """
        body = to_json(message, inf_nan_mode="constants")
        if len(body) > LARGEST_BYTES:
            raise ValueError(f"it takes more than {LARGEST_BYTES >> 20} MB")
        self._end.settimeout(seconds)
        self._end.sendall(_LENGTH.pack(len(body)) + body)

    def has_news(self) -> bool:
        """Whether data arrived or the other end was closed."""
        self._end.settimeout(0.0)
        try:
            self._end.recv(1, socket.MSG_PEEK)
        except BlockingIOError:
            return False
        except OSError:
            return True  # broken: `receive` will raise the error
        return True

    def receive(self, seconds: float | None = None) -> Any:
        """Wait for a complete message, with a time limit.

        Raises:
            TimeoutError: It did not arrive in time.
            EOFError: The other end is closed.
            OSError: The connection broke.
            MessageError: The received data are no message.
        """
        deadline = None if seconds is None else time.monotonic() + seconds
        (length,) = _LENGTH.unpack(self._read(_LENGTH.size, deadline))
        if length > LARGEST_BYTES:
            raise MessageError(f"its answer takes more than {LARGEST_BYTES >> 20} MB")
        body = self._read(length, deadline)
        try:
            check_room(body)
            return from_json(body)
        except ValueError as fault:
            raise MessageError(f"its answer cannot be read ({fault})") from fault

    def close(self) -> None:
        """Close this end."""
        self._end.close()

    def _read(self, count: int, deadline: float | None) -> bytes:
        data = bytearray()
        while len(data) < count:
            remaining = None if deadline is None else deadline - time.monotonic()
            if remaining is not None and remaining <= 0.0:
                raise TimeoutError
            self._end.settimeout(remaining)
            chunk = self._end.recv(min(_CHUNK, count - len(data)))
            if not chunk:
                raise EOFError
            data += chunk
        return bytes(data)

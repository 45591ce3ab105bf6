"""Notifications to systemd (`Type=notify`): ready, alive, stopping."""

from __future__ import annotations

import os
import socket
from contextlib import suppress


def notify_manager(state: str) -> None:
    """Notify the service manager, if it started this process.

    Args:
        state: Such as 'READY=1', 'WATCHDOG=1', 'STOPPING=1'.
    """
    path = os.environ.get("NOTIFY_SOCKET")
    if not path:
        return
    address = f"\0{path[1:]}" if path.startswith("@") else path
    with suppress(OSError), socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as sender:
        sender.connect(address)
        sender.send(state.encode())

"""Words to systemd, where it has begun the service (`Type=notify`): ready, alive, stopping."""

from __future__ import annotations

import os
import socket
from contextlib import suppress


def notify_manager(state: str) -> None:
    """Tell the service manager something; nobody listens where it did not begin this process.

    Args:
        state: Such as 'READY=1', 'WATCHDOG=1', 'STOPPING=1'.
    """
    place = os.environ.get("NOTIFY_SOCKET")
    if not place:
        return
    address = f"\0{place[1:]}" if place.startswith("@") else place
    with suppress(OSError), socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as told:
        told.connect(address)
        told.send(state.encode())

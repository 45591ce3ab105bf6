"""Network cameras on loopback (MJPEG over HTTP) that randomly stall, drop and send garbage."""

from __future__ import annotations

import random
import threading
import time
from collections.abc import Sequence
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

from visup.evaluation.serving.scene import FPS

BOUNDARY = "frame"
MEAN_FAULT_INTERVAL_S = 40.0
"""Mean seconds between two faults of a camera."""

STALL_S = (2.0, 8.0)


class FaultyStream:
    """A network camera with faults.

    Args:
        pictures: JPEG images of one cycle of the scene.
        seed: Random seed.

    Attributes:
        url: Its URL.
        faults: Number of faults.
    """

    def __init__(self, pictures: Sequence[bytes], seed: int) -> None:
        self._pictures = pictures
        self._rng = random.Random(seed)  # dice, not secrets
        self._start = time.monotonic()
        self._next_fault = self._pause()
        self._closed = threading.Event()
        self.faults = 0
        self._server = ThreadingHTTPServer(("127.0.0.1", 0), self._handler())
        self._server.daemon_threads = True
        self.url = f"http://127.0.0.1:{self._server.server_address[1]}/stream.mjpg"
        threading.Thread(target=self._server.serve_forever, args=(0.05,), daemon=True).start()

    def close(self) -> None:
        """Stop it."""
        self._closed.set()
        self._server.shutdown()
        self._server.server_close()

    def _pause(self) -> float:
        return time.monotonic() + self._rng.expovariate(1.0 / MEAN_FAULT_INTERVAL_S)

    def _send_to(self, out: Any) -> None:
        """Send frames in real time until the connection drops."""
        while not self._closed.wait(1.0 / FPS):
            number = int((time.monotonic() - self._start) * FPS) % len(self._pictures)
            picture = self._pictures[number]
            if time.monotonic() > self._next_fault:
                self._next_fault = self._pause()
                self.faults += 1
                fault = self._rng.choice(("stall", "drop", "garbage", "cut off"))
                if fault == "drop":
                    return
                if fault == "stall":
                    self._closed.wait(self._rng.uniform(*STALL_S))
                picture = self._corrupted(fault, picture)
            head = f"--{BOUNDARY}\r\nContent-Type: image/jpeg\r\nContent-Length: {len(picture)}\r\n\r\n"
            out.write(head.encode() + picture + b"\r\n")

    def _corrupted(self, fault: str, picture: bytes) -> bytes:
        if fault == "garbage":
            return self._rng.randbytes(len(picture))
        return picture[: len(picture) // 3] if fault == "cut off" else picture

    def _handler(self) -> type[BaseHTTPRequestHandler]:
        send_to = self._send_to

        class StreamHandler(BaseHTTPRequestHandler):
            def do_GET(self) -> None:
                self.send_response(200)
                kind = f"multipart/x-mixed-replace; boundary={BOUNDARY}"
                self.send_header("Content-Type", kind)
                self.end_headers()
                try:
                    send_to(self.wfile)
                except OSError:
                    self.close_connection = True

            def log_message(self, *arguments: Any) -> None:
                pass

        return StreamHandler

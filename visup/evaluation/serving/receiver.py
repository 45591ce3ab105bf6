"""A server that receives records of alerts, and can be made unavailable."""

from __future__ import annotations

import json
import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

MAX_BODY_BYTES = 2**20


class AlertReceiver:
    """Receives records.

    Attributes:
        records: Received records, in order.
        down: Whether it refuses all requests.
        refused: Number of refused requests.
        port: Its port.
    """

    def __init__(self) -> None:
        self.records: list[dict[str, Any]] = []
        self.down = False
        self.refused = 0
        self._server = ThreadingHTTPServer(("127.0.0.1", 0), self._handler())
        self._server.daemon_threads = True
        self.port = int(self._server.server_address[1])
        threading.Thread(target=self._server.serve_forever, args=(0.05,), daemon=True).start()

    def close(self) -> None:
        """Stop."""
        self._server.shutdown()
        self._server.server_close()

    def _take(self, body: bytes) -> int:
        """Handle a record; returns the HTTP status."""
        if self.down:
            self.refused += 1
            return 503
        self.records.append(json.loads(body))
        return 204

    def _handler(self) -> type[BaseHTTPRequestHandler]:
        take = self._take

        class ReceiverHandler(BaseHTTPRequestHandler):
            def do_POST(self) -> None:
                size = min(int(self.headers.get("Content-Length", 0)), MAX_BODY_BYTES)
                self.send_response(take(self.rfile.read(size)))
                self.end_headers()

            def log_message(self, *arguments: Any) -> None:
                pass

        return ReceiverHandler

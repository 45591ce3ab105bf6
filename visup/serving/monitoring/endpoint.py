"""The HTTP server of the monitoring endpoints; by default it listens on this machine only.

It serves three paths, reads only the request line and headers, and runs in its own threads, so that slow or
hanging clients do not affect the cameras.
"""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Callable
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from socket import AF_INET, AF_INET6
from typing import Any

from visup.agent.model.errors import ExtraMissingError, OutputError
from visup.serving.monitoring.prometheus import metrics_page
from visup.serving.monitoring.status import SiteStatus

CLIENT_TIMEOUT_S = 5.0
"""Socket timeout for a client, seconds."""

MAX_CLIENTS = 16
"""Concurrent requests; further ones are closed at once."""

Response = tuple[HTTPStatus, bytes, str]


class MonitoringServer:
    """Answers `/healthz`, `/readyz` and `/metrics`.

    Args:
        host: Address to listen on.
        port: Port; 0 for any free one.
        clock: Monotonic clock, seconds, for ages.

    Attributes:
        status: The state of the site; replaced as a whole by its owner.
        address: HOST:PORT that it listens on, for URLs.

    Raises:
        OutputError: It cannot listen there.
    """

    def __init__(self, host: str, port: int, clock: Callable[[], float] = time.monotonic) -> None:
        self.status = SiteStatus(clock())
        self._clock = clock
        try:
            self._server = _server_of(host)((host, port), self._handler())
        except OSError as fault:
            raise OutputError(
                f"nobody can be told how the service does ({fault.strerror or fault})",
                where=f"{host}:{port}",
                hint='choose another address: [monitoring], listen = "127.0.0.1:9465"',
            ) from fault
        shown = f"[{host}]" if ":" in host else host
        self.address = f"{shown}:{self._server.server_address[1]}"
        self._thread = threading.Thread(
            target=self._server.serve_forever, args=(0.2,), name="monitoring", daemon=True
        )
        self._thread.start()

    def close(self) -> None:
        """Stop listening."""
        self._server.shutdown()
        self._server.server_close()

    def answer(self, path: str, accept: str = "") -> Response:
        """The response to a path: status, body, content type."""
        status, now = self.status, self._clock()
        if path == "/healthz":
            return _json(status.healthy(now), {"healthy": status.healthy(now)})
        if path == "/readyz":
            states = {c.name: c.state for c in status.cameras}
            return _json(status.ready(now), {"ready": status.ready(now), "cameras": states})
        if path == "/metrics":
            try:
                return (HTTPStatus.OK, *metrics_page(status, accept))
            except ExtraMissingError as missing:
                return HTTPStatus.SERVICE_UNAVAILABLE, f"{missing}\n".encode(), _TEXT
        body = b"/healthz, /readyz and /metrics are what there is.\n"
        return HTTPStatus.NOT_FOUND, body, _TEXT

    def _handler(self) -> type[BaseHTTPRequestHandler]:
        answer = self.answer

        class MonitoringHandler(BaseHTTPRequestHandler):
            timeout = CLIENT_TIMEOUT_S
            server_version, sys_version = "visup", ""

            def do_GET(self) -> None:
                self._send(*answer(self.path.partition("?")[0], self.headers.get("Accept", "")))

            def do_HEAD(self) -> None:
                status, _, kind = answer(self.path.partition("?")[0])
                self._send(status, b"", kind)

            def _send(self, status: HTTPStatus, body: bytes, kind: str) -> None:
                self.send_response(status)
                self.send_header("Content-Type", kind)
                self.send_header("Content-Length", str(len(body)))
                self.send_header("X-Content-Type-Options", "nosniff")
                self.end_headers()
                self.wfile.write(body)

            def log_message(self, *arguments: Any) -> None:
                """Requests are not logged."""

        return MonitoringHandler


class _BoundedServer(ThreadingHTTPServer):
    daemon_threads = True
    request_queue_size = MAX_CLIENTS

    def __init__(self, *arguments: Any) -> None:
        self._free_slots = threading.BoundedSemaphore(MAX_CLIENTS)
        super().__init__(*arguments)

    def process_request(self, request: Any, client_address: Any) -> None:
        if not self._free_slots.acquire(blocking=False):
            self.shutdown_request(request)
            return
        super().process_request(request, client_address)

    def process_request_thread(self, request: Any, client_address: Any) -> None:
        try:
            super().process_request_thread(request, client_address)
        finally:
            self._free_slots.release()

    def handle_error(self, request: Any, client_address: Any) -> None:
        """A client that disconnected is no error of the service."""


def _server_of(host: str) -> type[_BoundedServer]:
    family = AF_INET6 if ":" in host else AF_INET
    return type("_Server", (_BoundedServer,), {"address_family": family})


_TEXT = "text/plain; charset=utf-8"


def _json(ok: bool, body: dict[str, Any]) -> Response:
    status = HTTPStatus.OK if ok else HTTPStatus.SERVICE_UNAVAILABLE
    return status, json.dumps(body).encode() + b"\n", "application/json"

"""A sink that posts each record to a URL, using urllib3."""

from __future__ import annotations

import socket
import threading
import time
import urllib.request
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from errno import ETIMEDOUT
from http import HTTPStatus
from typing import Any

import urllib3
from urllib3.connection import HTTPConnection, HTTPSConnection
from urllib3.connectionpool import HTTPConnectionPool, HTTPSConnectionPool
from urllib3.exceptions import HTTPError, LocationParseError
from urllib3.util import parse_url

from visup.agent.model.errors import SettingsError
from visup.redaction import redacted
from visup.sinks.lines import TIMEOUT_S, json_text
from visup.sinks.webhook_access import WebhookAccess

MAX_ATTEMPTS = 4
INITIAL_WAIT_S = 0.5
TOO_MANY_REQUESTS = 429
HEADERS = {"Content-Type": "application/json", "User-Agent": "visup"}


class DeliveryError(OSError):
    """A record was not accepted.

    Attributes:
        final: Whether retrying is useless.
    """

    def __init__(self, message: str, *, final: bool = False) -> None:
        super().__init__(message)
        self.final = final


class Webhook:
    """Posts each record as JSON to a URL.

    A server that is unreachable or reports a temporary fault (5xx or 429) is retried with doubling waits; any
    other response except 2xx is final. Redirects are not followed: that would drop the body, and let the
    server direct visup to addresses that only this machine can reach. Only the status of a response is read,
    and an attempt ends after `timeout_s` whatever the server does.

    Args:
        url: http or https URL.
        timeout_s: Time limit of one attempt, seconds.
        tries: Attempts per record.
        access: Authentication.
        wait: Sleeps for some seconds; replaced in tests.

    Raises:
        SettingsError: It is no such URL.
    """

    def __init__(
        self,
        url: str,
        *,
        timeout_s: float = TIMEOUT_S,
        tries: int = MAX_ATTEMPTS,
        access: WebhookAccess | None = None,
        wait: Callable[[float], None] = time.sleep,
    ) -> None:
        if not _is_web_address(url):
            raise SettingsError(
                f"--sink webhook:{redacted(url)}", expected="an http or https address"
            )
        self.name = f"webhook:{_printable_url(url)}"
        self._url, self._timeout_s, self._tries, self._wait = url, timeout_s, tries, wait
        self._access = access or WebhookAccess()
        self._sockets: list[socket.socket] = []
        self._manager = _manager(url, self._sockets)

    def deliver(self, record: Mapping[str, Any]) -> None:
        """Post one record.

        Raises:
            DeliveryError: It was not accepted.
        """
        body = json_text(record).encode()
        for attempt in range(self._tries):
            last = attempt + 1 == self._tries
            try:
                status = self._post(body)
            except (HTTPError, OSError) as fault:
                if last:
                    raise DeliveryError(_reason(fault)) from fault
            else:
                if 200 <= status < 300:
                    return
                final = status < 500 and status != TOO_MANY_REQUESTS
                if final or last:
                    raise DeliveryError(_status_text(status), final=final)
            self._wait(INITIAL_WAIT_S * 2**attempt)

    def close(self) -> None:
        """Close the connection."""
        self._manager.clear()

    def _post(self, body: bytes) -> int:
        """The status of the response."""
        with self._deadline():
            answer = self._manager.urlopen(
                "POST",
                self._url,
                body=body,
                headers={**HEADERS, **self._access.headers_for(body, time.time())},
                timeout=self._timeout_s,
                retries=False,
                redirect=False,
                preload_content=False,
            )
            status = int(answer.status)
            answer.close()  # closes the connection; the body is not read
            return status

    @contextmanager
    def _deadline(self) -> Iterator[None]:
        """Close the connection at the deadline, even if the server keeps sending slowly."""
        expired = threading.Event()
        timer = threading.Timer(self._timeout_s, self._shut_down, (expired,))
        timer.daemon = True
        timer.start()
        try:
            yield
        finally:
            timer.cancel()
            while self._sockets:
                self._sockets.pop().close()
        if expired.is_set():  # a partial response may look complete
            raise TimeoutError(ETIMEDOUT, "the server did not answer in time")

    def _shut_down(self, expired: threading.Event) -> None:
        expired.set()
        for connection in list(self._sockets):
            with suppress(OSError):
                connection.shutdown(socket.SHUT_RDWR)


def _printable_url(url: str) -> str:
    """A URL that is safe to print: chat services put their keys in the path."""
    parts = parse_url(url)
    port = f":{parts.port}" if parts.port else ""
    ellipsis = "/..." if (parts.path or "/") != "/" or parts.query else ""
    return f"{parts.scheme}://{parts.host}{port}{ellipsis}"


def _is_web_address(url: str) -> bool:
    try:
        parts = parse_url(url)
    except LocationParseError:
        return False
    return parts.scheme in ("http", "https") and bool(parts.host)


def _manager(url: str, sockets: list[socket.socket]) -> urllib3.PoolManager:
    """A connection manager that respects the environment (`https_proxy` etc.) and records its sockets."""

    class RecordingConnection(HTTPConnection):
        def _new_conn(self) -> socket.socket:
            return _recorded(super()._new_conn(), sockets)

    class RecordingTlsConnection(HTTPSConnection):
        def _new_conn(self) -> socket.socket:
            return _recorded(super()._new_conn(), sockets)

    parts = parse_url(url)
    proxy = urllib.request.getproxies().get(parts.scheme or "")
    direct = proxy is None or urllib.request.proxy_bypass(parts.host or "")
    manager = urllib3.PoolManager() if direct else urllib3.ProxyManager(str(proxy))
    plain = type("NotedPool", (HTTPConnectionPool,), {"ConnectionCls": RecordingConnection})
    tls = type("NotedTlsPool", (HTTPSConnectionPool,), {"ConnectionCls": RecordingTlsConnection})
    manager.pool_classes_by_scheme = {"http": plain, "https": tls}
    return manager


def _recorded(connection: socket.socket, sockets: list[socket.socket]) -> socket.socket:
    # A duplicate, since the TLS wrapper takes over the original socket.
    sockets.append(connection.dup())
    return connection


def _status_text(status: int) -> str:
    """A status in our own words: the server's are untrusted."""
    if 300 <= status < 400:
        return f"the server answered {status}: it redirects, which is not followed"
    try:
        return f"the server answered {status} ({HTTPStatus(status).phrase})"
    except ValueError:
        return f"the server answered {status}"


def _reason(fault: Exception) -> str:
    """The reason of a fault, without internals of the library."""
    inner = getattr(fault, "reason", None) or fault.__cause__ or fault
    if isinstance(inner, OSError) and inner.strerror:
        return inner.strerror
    return f"{type(inner).__name__.removesuffix('Error')}: no answer that could be read"

"""The sink that posts each record to a URL, by urllib3."""

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

TRIES = 4
FIRST_WAIT_S = 0.5
BUSY = 429
HEADERS = {"Content-Type": "application/json", "User-Agent": "visup"}


class DeliveryError(OSError):
    """A record was not taken.

    Attributes:
        final: Whether it will not be, however often it is sent.
    """

    def __init__(self, said: str, *, final: bool = False) -> None:
        super().__init__(said)
        self.final = final


class Webhook:
    """Posts each record as JSON to a URL.

    A server that cannot be reached or says that it is at fault (5xx, or 429) is tried again, each time
    after twice as long; any other answer but 2xx is final. A redirect is such an answer: followed, it would
    turn the record into a request without one, and let the server send visup to places that it may
    reach and the server may not. Of an answer only its status is read, and an attempt ends after
    `timeout_s` whatever the server does.

    Args:
        url: http or https.
        timeout_s: For one attempt, seconds.
        tries: Attempts for one record.
        access: How the server knows that it comes from here.
        wait: Waits so many seconds; an argument so that tests need not.

    Raises:
        SettingsError: It is no such URL.
    """

    def __init__(
        self,
        url: str,
        *,
        timeout_s: float = TIMEOUT_S,
        tries: int = TRIES,
        access: WebhookAccess | None = None,
        wait: Callable[[float], None] = time.sleep,
    ) -> None:
        if not _is_web_address(url):
            raise SettingsError(
                f"--sink webhook:{redacted(url)}", expected="an http or https address"
            )
        self.name = f"webhook:{_shown(url)}"
        self._url, self._timeout_s, self._tries, self._wait = url, timeout_s, tries, wait
        self._access = access or WebhookAccess()
        self._opened: list[socket.socket] = []
        self._manager = _manager(url, self._opened)

    def deliver(self, record: Mapping[str, Any]) -> None:
        """Post one record.

        Raises:
            DeliveryError: It was not taken.
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
                final = status < 500 and status != BUSY
                if final or last:
                    raise DeliveryError(_answer(status), final=final)
            self._wait(FIRST_WAIT_S * 2**attempt)

    def close(self) -> None:
        """Close the connection."""
        self._manager.clear()

    def _post(self, body: bytes) -> int:
        """The status of the answer."""
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
            answer.close()  # with its connection: of the body nothing is read
            return status

    @contextmanager
    def _deadline(self) -> Iterator[None]:
        """End the connection when the time is over, also where a byte comes now and then."""
        over = threading.Event()
        timer = threading.Timer(self._timeout_s, self._hang_up, (over,))
        timer.daemon = True
        timer.start()
        try:
            yield
        finally:
            timer.cancel()
            while self._opened:
                self._opened.pop().close()
        if over.is_set():  # half an answer may look like a whole one
            raise TimeoutError(ETIMEDOUT, "the server did not answer in time")

    def _hang_up(self, over: threading.Event) -> None:
        over.set()
        for opened in list(self._opened):
            with suppress(OSError):
                opened.shutdown(socket.SHUT_RDWR)


def _shown(url: str) -> str:
    """An address safe to print: chat services put their keys in the path."""
    told = parse_url(url)
    port = f":{told.port}" if told.port else ""
    beyond = "/..." if (told.path or "/") != "/" or told.query else ""
    return f"{told.scheme}://{told.host}{port}{beyond}"


def _is_web_address(url: str) -> bool:
    try:
        told = parse_url(url)
    except LocationParseError:
        return False
    return told.scheme in ("http", "https") and bool(told.host)


def _manager(url: str, opened: list[socket.socket]) -> urllib3.PoolManager:
    """Connections as the environment says (`https_proxy` and the like), each noted when it is made."""

    class Noted(HTTPConnection):
        def _new_conn(self) -> socket.socket:
            return _noted(super()._new_conn(), opened)

    class NotedTls(HTTPSConnection):
        def _new_conn(self) -> socket.socket:
            return _noted(super()._new_conn(), opened)

    told = parse_url(url)
    proxy = urllib.request.getproxies().get(told.scheme or "")
    direct = proxy is None or urllib.request.proxy_bypass(told.host or "")
    manager = urllib3.PoolManager() if direct else urllib3.ProxyManager(str(proxy))
    plain = type("NotedPool", (HTTPConnectionPool,), {"ConnectionCls": Noted})
    tls = type("NotedTlsPool", (HTTPSConnectionPool,), {"ConnectionCls": NotedTls})
    manager.pool_classes_by_scheme = {"http": plain, "https": tls}
    return manager


def _noted(made: socket.socket, opened: list[socket.socket]) -> socket.socket:
    # A second handle: that of a connection with TLS is taken over by what wraps it.
    opened.append(made.dup())
    return made


def _answer(status: int) -> str:
    """A status in words of our own: the server's may hold anything."""
    if 300 <= status < 400:
        return f"the server answered {status}: it redirects, which is not followed"
    try:
        return f"the server answered {status} ({HTTPStatus(status).phrase})"
    except ValueError:
        return f"the server answered {status}"


def _reason(fault: Exception) -> str:
    """What went wrong, without the workings of the library."""
    inner = getattr(fault, "reason", None) or fault.__cause__ or fault
    if isinstance(inner, OSError) and inner.strerror:
        return inner.strerror
    return f"{type(inner).__name__.removesuffix('Error')}: no answer that could be read"

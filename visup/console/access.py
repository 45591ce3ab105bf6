"""Access control for every request, page, picture and socket of the console.

- By default the console listens on this machine only.
- Every request needs a token. The printed address contains it once; from then on a cookie does.
- A request must name this host, so that no foreign name that resolves to it is accepted (DNS rebinding), and
  cross-origin requests are refused, also for the socket, to which browsers let any page connect.
- The operator's token may act (note, assume, try other texts); the viewer's is read-only.
"""

from __future__ import annotations

import secrets
from collections.abc import Awaitable, Callable, Iterable, Mapping, MutableMapping
from dataclasses import dataclass, field
from enum import StrEnum
from http.cookies import CookieError, SimpleCookie
from typing import Any
from urllib.parse import parse_qs, quote, urlsplit

from visup.console.plain_page import plain_page

Scope = MutableMapping[str, Any]
Message = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Message]]
Send = Callable[[Message], Awaitable[None]]
Application = Callable[[Scope, Receive, Send], Awaitable[None]]

COOKIE = "visup_console"
QUERY_PARAMETER = "token"
LOOPBACK = ("127.0.0.1", "localhost", "[::1]", "::1")
ROLE_KEY = "visup_role"
"""Key of the role in the scope of a request."""

MAX_BODY_BYTES = 2**20
"""Maximum size of the body of a request; pages send far less."""


class ConsoleRole(StrEnum):
    """The permissions of a token."""

    VIEWER = "viewer"
    OPERATOR = "operator"


@dataclass(frozen=True, slots=True)
class Access:
    """Access by tokens and host names.

    Attributes:
        operator: Token for full access.
        viewer: Token for read-only access, or None.
        hosts: Accepted host names, without ports.
    """

    operator: str = field(default_factory=lambda: secrets.token_urlsafe(18))
    viewer: str | None = None
    hosts: tuple[str, ...] = LOOPBACK

    def role(self, token: str) -> ConsoleRole | None:
        """The role of a token, or None."""
        encoded = token.encode()
        if secrets.compare_digest(encoded, self.operator.encode()):
            return ConsoleRole.OPERATOR
        if self.viewer and secrets.compare_digest(encoded, self.viewer.encode()):
            return ConsoleRole.VIEWER
        return None


class AccessGuard:
    """Middleware that passes only permitted requests to the application.

    Args:
        app: The application.
        access: Access by tokens and host names.
    """

    def __init__(self, app: Application, access: Access) -> None:
        self._app, self._access = app, access

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle one request or socket."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        headers = _headers(scope["headers"])
        refusal = self._refusal_reason(headers)
        query = parse_qs(scope.get("query_string", b"").decode("latin-1"))
        token = query.get(QUERY_PARAMETER, [""])[0]
        role = self._access.role(token or _token_in_cookie(headers.get("cookie", "")))
        if refusal or role is None:
            await _refuse(scope, send, refusal or _HOW_TO_OPEN, headers.get("accept", ""))
        elif token and scope["type"] == "http":
            await _set_cookie(scope, send, token)
        else:
            scope[ROLE_KEY] = role
            await self._app(scope, receive, send)

    def _refusal_reason(self, headers: Mapping[str, str]) -> str:
        """Why a request is refused regardless of its token; empty if it is not."""
        host = headers.get("host", "")
        if _without_port(host) not in self._access.hosts:
            return "This console is not known by that name."
        origin = headers.get("origin")
        if origin is not None and urlsplit(origin).netloc != host:
            return "This request came from another page; only the console's own pages may make it."
        length = headers.get("content-length", "0")
        if not length.isdecimal() or int(length) > MAX_BODY_BYTES:
            return "This request is too long."
        return ""


_HOW_TO_OPEN = (
    "Open it by the address that visup console printed when it started, which ends in ?token=... , "
    "or by one with the token that stands in the site file."
)


def _headers(raw: Iterable[tuple[bytes, bytes]]) -> dict[str, str]:
    return {name.decode("latin-1").lower(): value.decode("latin-1") for name, value in raw}


def _without_port(host: str) -> str:
    """A host name without its port."""
    name, colon, port = host.rpartition(":")
    return name if colon and port.isdecimal() else host


def _token_in_cookie(text: str) -> str:
    try:
        found = SimpleCookie(text).get(COOKIE)
    except CookieError:
        return ""
    return found.value if found else ""


async def _set_cookie(scope: Scope, send: Send, token: str) -> None:
    """Move the token from the address to a cookie that scripts cannot read."""
    cookie = f"{COOKIE}={token}; HttpOnly; SameSite=Strict; Path=/"
    # Two leading slashes would redirect to another host.
    location = "/" + quote(scope["path"].lstrip("/\\"))
    headers = [(b"location", location.encode()), (b"set-cookie", cookie.encode())]
    await send(
        {"type": "http.response.start", "status": 303, "headers": [*headers, *_SECURITY_HEADERS]}
    )
    await send({"type": "http.response.body", "body": b""})


async def _refuse(scope: Scope, send: Send, reason: str, accept: str) -> None:
    if scope["type"] == "websocket":
        await send({"type": "websocket.close", "code": 4403, "reason": reason})
        return
    page = "text/html" in accept
    kind = b"text/html" if page else b"text/plain"
    headers = [(b"content-type", kind + b"; charset=utf-8"), *_SECURITY_HEADERS]
    body = plain_page("This console is closed to you", reason) if page else reason.encode()
    await send({"type": "http.response.start", "status": 403, "headers": headers})
    await send({"type": "http.response.body", "body": body})


_SECURITY_HEADERS = (
    (b"referrer-policy", b"no-referrer"),
    (b"x-content-type-options", b"nosniff"),
    (b"cache-control", b"no-store"),
)

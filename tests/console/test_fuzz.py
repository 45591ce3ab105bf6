"""No request causes an internal error, reads a file from outside, or opens a socket without permission."""

from __future__ import annotations

import base64
import os
import socket
from contextlib import suppress
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tests.console.conftest import SECRET
from tests.console.running import OPERATOR
from visup.console.access import COOKIE
from visup.console.library import run_key

OPERATOR_COOKIE = f"Cookie: {COOKIE}={OPERATOR}"
ROUTES = ("", "wall", "run", "picture", "thumbnail", "evidence", "_nicegui", "_nicegui_ws", "docs")
HOSTILE_PARTS = (
    *("..", "../../secret.txt", "%2e%2e%2f%2e%2e%2fsecret.txt", "..%5c..", "%00", "%0d%0aX: y"),
    *("-1", "0", "99999999", "1" * 400, "9" * 5000, "1.jpg", "-1.jpg", "0.jpg", "1e9.jpg"),
    *("1.webm", "1.txt", "nan", "KEY", "KEY.jpg", "a" * 2000, "%ff%fe", "%E2%80%AE", "<b>", "'"),
    *("socket.io", "static", "components", "libraries", "dynamic_resources", "auto", "{x}", "*"),
)
QUERIES = ("", "?t=nan", "?t=inf", "?t=-1e999", "?t=x", "?plain=9", "?plain=1", "?EIO=4", "?a=%00")
METHODS = ("GET", "HEAD", "POST", "PUT", "DELETE", "OPTIONS", "PATCH", "TRACE", "BREW")
BODIES = (b"", b"{}", b"0", b"\x00\xff" * 40, b'[{"event":"x"}]' * 40, b"a=b&c=d")


def send_request(console: str, request: str, *headers: str, body: bytes = b"") -> tuple[int, bytes]:
    """Status and answer; 0 if the connection was closed without one."""
    address = urlsplit(console)
    lines = [f"{request} HTTP/1.1", f"Host: {address.netloc}", *headers]
    if body:
        lines.append(f"Content-Length: {len(body)}")
    if not any(line.startswith("Upgrade") for line in headers):
        lines.append("Connection: close")
    sent = "\r\n".join([*lines, "", ""]).encode("latin-1", "replace") + body
    answer = b""
    with (
        socket.create_connection((address.hostname, address.port), timeout=60) as line,
        suppress(ConnectionError),  # a body that was not wanted is not read to its end
    ):
        line.sendall(sent)
        while (chunk := line.recv(65536)) and len(answer) < 2**22:
            answer += chunk
            if answer.startswith(b"HTTP/1.1 101"):
                break
    status = answer.split(b" ", 2)[1:2]
    return (int(status[0]) if status else 0), answer


def checked_status(console: str, request: str, *headers: str, body: bytes = b"") -> int:
    status, answer = send_request(console, request, *headers, body=body)
    assert status < 500, (request, answer[:500])
    assert SECRET.encode() not in answer
    assert b"root:x:" not in answer
    assert b"Traceback" not in answer
    return status


@settings(
    max_examples=120,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)
@given(
    st.sampled_from(METHODS),
    st.sampled_from(ROUTES),
    st.lists(
        st.sampled_from(HOSTILE_PARTS)
        | st.text(
            st.characters(min_codepoint=33, max_codepoint=126, exclude_characters="#?"), max_size=8
        ),
        max_size=3,
    ),
    st.sampled_from(QUERIES),
    st.sampled_from(BODIES),
)
def test_no_request_causes_an_internal_error(
    console: str, folder: Path, method: str, route: str, parts: list[str], query: str, body: bytes
) -> None:
    key = run_key(folder / "evening")
    path = "/".join(["", route, *(p.replace("KEY", key) for p in parts)])
    checked_status(console, f"{method} {path}{query}", OPERATOR_COOKIE, body=body)


@pytest.mark.parametrize(
    ("path", "status"),
    [
        ("/", 200),
        ("/wall", 200),
        ("/run/KEY", 200),
        ("/run/KEY?t=nan", 200),
        ("/run/KEY?t=inf", 200),
        ("/run/0123456789abcdef", 200),
        ("/picture/KEY/0.jpg", 200),
        ("/picture/KEY/59.jpg?plain=1", 200),
        ("/picture/KEY/60.jpg", 404),
        ("/picture/KEY/-1.jpg", 404),
        ("/picture/KEY/x.jpg", 422),
        ("/picture/../secret.txt", 404),
        ("/thumbnail/KEY.jpg", 200),
        ("/thumbnail/nobody.jpg", 404),
        ("/evidence/KEY/1.jpg", 200),
        ("/evidence/KEY/1.webm", 200),
        ("/evidence/KEY/777.jpg", 404),
        ("/evidence/KEY/-1.jpg", 404),
        ("/evidence/KEY/1.json", 422),
        ("/evidence/nobody/1.jpg", 404),
        ("/docs", 404),
        ("/openapi.json", 404),
    ],
)
def test_each_address_has_its_status(console: str, folder: Path, path: str, status: int) -> None:
    known = path.replace("KEY", run_key(folder / "evening"))
    assert checked_status(console, f"GET {known}", OPERATOR_COOKIE) == status
    assert checked_status(console, f"GET {known}") == 403
    assert (
        checked_status(console, f"GET {known}", OPERATOR_COOKIE, "Origin: http://evil.example")
        == 403
    )


@pytest.mark.parametrize("size", ["99999999", "-1", "x", "1, 2", ""])
def test_long_and_malformed_bodies_are_refused(console: str, size: str) -> None:
    answer = checked_status(console, "POST /wall", OPERATOR_COOKIE, f"Content-Length: {size}")
    assert answer in (0, 400, 403, 405)


def test_a_clip_is_served_by_ranges(console: str, folder: Path) -> None:
    path = f"/evidence/{run_key(folder / 'evening')}/1.webm"
    assert checked_status(console, f"GET {path}", OPERATOR_COOKIE, "Range: bytes=0-9") == 206
    assert checked_status(console, f"GET {path}", OPERATOR_COOKIE, "Range: bytes=99999999-") == 416
    assert checked_status(console, f"GET {path}", OPERATOR_COOKIE, "Range: nonsense") in (
        200,
        400,
        416,
    )


@pytest.mark.parametrize(
    "path", ["//evil.example/x", "/\\evil.example", "/%0d%0aX:%20y", "/%E2%82%AC"]
)
def test_the_redirect_with_the_token_stays_on_this_host(console: str, path: str) -> None:
    status, answer = send_request(console, f"GET {path}?token={OPERATOR}")
    assert status in (303, 400)
    head = answer.decode("latin-1").lower()
    if status == 303:
        address = head.split("location: ")[1].split("\r\n")[0]
        assert address.startswith("/")
        assert not address.startswith(("//", "/\\"))
        assert "\r\nx:" not in head


@pytest.mark.parametrize(
    ("path", "headers"),
    [
        ("/_nicegui_ws/socket.io/?EIO=4&transport=websocket", ()),
        (
            "/_nicegui_ws/socket.io/?EIO=4&transport=websocket",
            (OPERATOR_COOKIE, "Origin: http://evil.example"),
        ),
        ("/_nicegui_ws/socket.io/?EIO=4&transport=websocket", (OPERATOR_COOKIE, "Origin: null")),
        ("/run/x", (OPERATOR_COOKIE,)),
        ("/../..", (OPERATOR_COOKIE,)),
        ("/", (OPERATOR_COOKIE,)),
    ],
)
def test_sockets_without_permission_are_refused(
    console: str, path: str, headers: tuple[str, ...]
) -> None:
    key = base64.b64encode(os.urandom(16)).decode()
    upgrade = (
        "Upgrade: websocket",
        "Connection: Upgrade",
        f"Sec-WebSocket-Key: {key}",
        "Sec-WebSocket-Version: 13",
    )
    assert checked_status(console, f"GET {path}", *upgrade, *headers) in (400, 403, 404)

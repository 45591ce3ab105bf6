"""Whatever is asked of the console: no failure inside, no file from outside, no socket for strangers."""

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

MINE = f"Cookie: {COOKIE}={OPERATOR}"
ROUTES = ("", "wall", "run", "picture", "thumbnail", "evidence", "_nicegui", "_nicegui_ws", "docs")
UGLY = (
    *("..", "../../secret.txt", "%2e%2e%2f%2e%2e%2fsecret.txt", "..%5c..", "%00", "%0d%0aX: y"),
    *("-1", "0", "99999999", "1" * 400, "9" * 5000, "1.jpg", "-1.jpg", "0.jpg", "1e9.jpg"),
    *("1.webm", "1.txt", "nan", "KEY", "KEY.jpg", "a" * 2000, "%ff%fe", "%E2%80%AE", "<b>", "'"),
    *("socket.io", "static", "components", "libraries", "dynamic_resources", "auto", "{x}", "*"),
)
QUERIES = ("", "?t=nan", "?t=inf", "?t=-1e999", "?t=x", "?plain=9", "?plain=1", "?EIO=4", "?a=%00")
METHODS = ("GET", "HEAD", "POST", "PUT", "DELETE", "OPTIONS", "PATCH", "TRACE", "BREW")
BODIES = (b"", b"{}", b"0", b"\x00\xff" * 40, b'[{"event":"x"}]' * 40, b"a=b&c=d")


def ask(console: str, request: str, *headers: str, body: bytes = b"") -> tuple[int, bytes]:
    """Status and all that is answered; 0 where the connection is just closed."""
    place = urlsplit(console)
    lines = [f"{request} HTTP/1.1", f"Host: {place.netloc}", *headers]
    if body:
        lines.append(f"Content-Length: {len(body)}")
    if not any(line.startswith("Upgrade") for line in headers):
        lines.append("Connection: close")
    sent = "\r\n".join([*lines, "", ""]).encode("latin-1", "replace") + body
    told = b""
    with (
        socket.create_connection((place.hostname, place.port), timeout=60) as line,
        suppress(ConnectionError),  # a body that was not wanted is not read to its end
    ):
        line.sendall(sent)
        while (got := line.recv(65536)) and len(told) < 2**22:
            told += got
            if told.startswith(b"HTTP/1.1 101"):
                break
    status = told.split(b" ", 2)[1:2]
    return (int(status[0]) if status else 0), told


def check(console: str, request: str, *headers: str, body: bytes = b"") -> int:
    status, told = ask(console, request, *headers, body=body)
    assert status < 500, (request, told[:500])
    assert SECRET.encode() not in told
    assert b"root:x:" not in told
    assert b"Traceback" not in told
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
        st.sampled_from(UGLY)
        | st.text(
            st.characters(min_codepoint=33, max_codepoint=126, exclude_characters="#?"), max_size=8
        ),
        max_size=3,
    ),
    st.sampled_from(QUERIES),
    st.sampled_from(BODIES),
)
def test_no_address_method_or_body_makes_it_fail(
    console: str, folder: Path, method: str, route: str, parts: list[str], query: str, body: bytes
) -> None:
    key = run_key(folder / "evening")
    path = "/".join(["", route, *(p.replace("KEY", key) for p in parts)])
    check(console, f"{method} {path}{query}", MINE, body=body)


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
def test_what_each_address_answers(console: str, folder: Path, path: str, status: int) -> None:
    known = path.replace("KEY", run_key(folder / "evening"))
    assert check(console, f"GET {known}", MINE) == status
    assert check(console, f"GET {known}") == 403
    assert check(console, f"GET {known}", MINE, "Origin: http://evil.example") == 403


@pytest.mark.parametrize("size", ["99999999", "-1", "x", "1, 2", ""])
def test_long_and_odd_bodies_are_refused(console: str, size: str) -> None:
    told = check(console, "POST /wall", MINE, f"Content-Length: {size}")
    assert told in (0, 400, 403, 405)


def test_a_clip_is_given_in_parts(console: str, folder: Path) -> None:
    path = f"/evidence/{run_key(folder / 'evening')}/1.webm"
    assert check(console, f"GET {path}", MINE, "Range: bytes=0-9") == 206
    assert check(console, f"GET {path}", MINE, "Range: bytes=99999999-") == 416
    assert check(console, f"GET {path}", MINE, "Range: nonsense") in (200, 400, 416)


@pytest.mark.parametrize(
    "path", ["//evil.example/x", "/\\evil.example", "/%0d%0aX:%20y", "/%E2%82%AC"]
)
def test_the_token_never_leads_to_another_host(console: str, path: str) -> None:
    status, told = ask(console, f"GET {path}?token={OPERATOR}")
    assert status in (303, 400)
    head = told.decode("latin-1").lower()
    if status == 303:
        place = head.split("location: ")[1].split("\r\n")[0]
        assert place.startswith("/")
        assert not place.startswith(("//", "/\\"))
        assert "\r\nx:" not in head


@pytest.mark.parametrize(
    ("path", "headers"),
    [
        ("/_nicegui_ws/socket.io/?EIO=4&transport=websocket", ()),
        (
            "/_nicegui_ws/socket.io/?EIO=4&transport=websocket",
            (MINE, "Origin: http://evil.example"),
        ),
        ("/_nicegui_ws/socket.io/?EIO=4&transport=websocket", (MINE, "Origin: null")),
        ("/run/x", (MINE,)),
        ("/../..", (MINE,)),
        ("/", (MINE,)),
    ],
)
def test_sockets_are_refused(console: str, path: str, headers: tuple[str, ...]) -> None:
    key = base64.b64encode(os.urandom(16)).decode()
    upgrade = (
        "Upgrade: websocket",
        "Connection: Upgrade",
        f"Sec-WebSocket-Key: {key}",
        "Sec-WebSocket-Version: 13",
    )
    assert check(console, f"GET {path}", *upgrade, *headers) in (400, 403, 404)

"""Access control: host names, origins, tokens, sockets."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from visup.console.access import (
    COOKIE,
    ROLE_KEY,
    Access,
    AccessGuard,
    Message,
    Receive,
    Scope,
    Send,
)

ACCESS = Access(
    "operator-token-of-test", "viewer-token-of-a-test", ("127.0.0.1", "console.example")
)


def request(
    headers: dict[str, str], query: str = "", kind: str = "http"
) -> tuple[list[Message], str | None]:
    """The messages sent, and the role passed to the application, or None."""
    sent: list[Message] = []
    reached: list[str] = []

    async def app(scope: Scope, receive: Receive, send: Send) -> None:
        reached.append(str(scope[ROLE_KEY]))

    async def send(message: Message) -> None:
        sent.append(message)

    async def receive() -> Message:
        return {"type": "http.request"}

    scope: dict[str, Any] = {
        "type": kind,
        "path": "/run/1",
        "query_string": query.encode(),
        "headers": [(k.encode("latin-1"), v.encode("latin-1")) for k, v in headers.items()],
    }
    asyncio.run(AccessGuard(app, ACCESS)(scope, receive, send))
    return sent, reached[0] if reached else None


HOST = {"host": "127.0.0.1:8086"}
OPERATOR_HEADERS = {**HOST, "cookie": f"{COOKIE}={ACCESS.operator}"}


@pytest.mark.parametrize("kind", ["http", "websocket"])
@pytest.mark.parametrize(
    ("headers", "role"),
    [
        (OPERATOR_HEADERS, "operator"),
        ({**HOST, "cookie": f"a=b; {COOKIE}={ACCESS.viewer}"}, "viewer"),
        ({**OPERATOR_HEADERS, "origin": "http://127.0.0.1:8086"}, "operator"),
        ({**OPERATOR_HEADERS, "host": "console.example"}, "operator"),
        ({**OPERATOR_HEADERS, "origin": "http://127.0.0.1:9"}, None),
        ({**OPERATOR_HEADERS, "origin": "http://evil.example"}, None),
        ({**OPERATOR_HEADERS, "origin": "null"}, None),
        ({**OPERATOR_HEADERS, "host": "evil.example:8086"}, None),
        ({**OPERATOR_HEADERS, "host": ""}, None),
        ({**OPERATOR_HEADERS, "content-length": "9999999"}, None),
        ({**OPERATOR_HEADERS, "content-length": "-1"}, None),
        (HOST, None),
        ({**HOST, "cookie": f"{COOKIE}="}, None),
        ({**HOST, "cookie": f"{COOKIE}=operator-token-of-tes"}, None),
    ],
)
def test_host_origin_token_and_length_decide_who_gets_in(
    headers: dict[str, str], role: str | None, kind: str
) -> None:
    sent, reached = request(headers, kind=kind)
    assert reached == role
    if role is None:
        first = sent[0]
        assert first.get("status") == 403 or first["type"] == "websocket.close"


def test_refusals_are_pages_for_browsers_and_plain_text_for_others() -> None:
    page, _ = request({**HOST, "accept": "text/html,*/*"})
    plain, _ = request({**HOST, "accept": "*/*"})
    assert b"<h1>This console is closed to you</h1>" in page[1]["body"]
    assert plain[1]["body"].startswith(b"Open it by the address")
    for messages in (page, plain):
        assert b"script" not in messages[1]["body"]


def test_the_token_moves_from_the_address_to_a_cookie_hidden_from_scripts() -> None:
    sent, reached = request(HOST, f"token={ACCESS.operator}")
    headers = dict(sent[0]["headers"])
    assert (reached, sent[0]["status"]) == (None, 303)
    assert headers[b"location"] == b"/run/1"
    assert b"HttpOnly" in headers[b"set-cookie"]
    assert b"SameSite=Strict" in headers[b"set-cookie"]


@given(
    st.text(alphabet=st.characters(max_codepoint=255), max_size=60),
    st.sampled_from(["cookie", "host"]),
)
def test_no_other_cookie_or_host_gets_in(text: str, name: str) -> None:
    _, reached = request({**HOST, name: text.replace("\n", " ").replace("\r", " ")})
    assert reached is None


def test_each_console_has_its_own_token() -> None:
    assert Access().operator != Access().operator
    assert Access().role("") is None

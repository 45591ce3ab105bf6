"""Who gets in: names, origins, tokens, sockets."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from visup.console.access import COOKIE, WHO, Access, AccessGuard, Message, Receive, Scope, Send

ACCESS = Access(
    "operator-token-of-test", "viewer-token-of-a-test", ("127.0.0.1", "console.example")
)


def asked(
    headers: dict[str, str], query: str = "", kind: str = "http"
) -> tuple[list[Message], str | None]:
    """What is sent, and the role with which the application behind was reached, or None."""
    sent: list[Message] = []
    reached: list[str] = []

    async def app(scope: Scope, receive: Receive, send: Send) -> None:
        reached.append(str(scope[WHO]))

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
MINE = {**HOST, "cookie": f"{COOKIE}={ACCESS.operator}"}


@pytest.mark.parametrize("kind", ["http", "websocket"])
@pytest.mark.parametrize(
    ("headers", "role"),
    [
        (MINE, "operator"),
        ({**HOST, "cookie": f"a=b; {COOKIE}={ACCESS.viewer}"}, "viewer"),
        ({**MINE, "origin": "http://127.0.0.1:8086"}, "operator"),
        ({**MINE, "host": "console.example"}, "operator"),
        ({**MINE, "origin": "http://127.0.0.1:9"}, None),
        ({**MINE, "origin": "http://evil.example"}, None),
        ({**MINE, "origin": "null"}, None),
        ({**MINE, "host": "evil.example:8086"}, None),
        ({**MINE, "host": ""}, None),
        ({**MINE, "content-length": "9999999"}, None),
        ({**MINE, "content-length": "-1"}, None),
        (HOST, None),
        ({**HOST, "cookie": f"{COOKIE}="}, None),
        ({**HOST, "cookie": f"{COOKIE}=operator-token-of-tes"}, None),
    ],
)
def test_who_is_let_in(headers: dict[str, str], role: str | None, kind: str) -> None:
    sent, reached = asked(headers, kind=kind)
    assert reached == role
    if role is None:
        first = sent[0]
        assert first.get("status") == 403 or first["type"] == "websocket.close"


def test_who_is_not_let_in_is_told_in_a_page_or_in_words() -> None:
    page, _ = asked({**HOST, "accept": "text/html,*/*"})
    words, _ = asked({**HOST, "accept": "*/*"})
    assert b"<h1>This console is closed to you</h1>" in page[1]["body"]
    assert words[1]["body"].startswith(b"Open it by the address")
    for told in (page, words):
        assert b"script" not in told[1]["body"]


def test_the_token_goes_from_the_address_into_a_cookie_that_scripts_cannot_read() -> None:
    sent, reached = asked(HOST, f"token={ACCESS.operator}")
    headers = dict(sent[0]["headers"])
    assert (reached, sent[0]["status"]) == (None, 303)
    assert headers[b"location"] == b"/run/1"
    assert b"HttpOnly" in headers[b"set-cookie"]
    assert b"SameSite=Strict" in headers[b"set-cookie"]


@given(
    st.text(alphabet=st.characters(max_codepoint=255), max_size=60),
    st.sampled_from(["cookie", "host"]),
)
def test_nothing_else_gets_in(text: str, name: str) -> None:
    _, reached = asked({**HOST, name: text.replace("\n", " ").replace("\r", " ")})
    assert reached is None


def test_two_consoles_have_two_tokens() -> None:
    assert Access().operator != Access().operator
    assert Access().role("") is None

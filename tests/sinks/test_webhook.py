"""Servers that mean harm, or are in trouble: a webhook is neither led astray nor held up by them."""

from __future__ import annotations

import hashlib
import hmac
import itertools
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

import pytest
from hypothesis import given
from hypothesis import strategies as st

from visup.agent.model.errors import SettingsError
from visup.runs.settings import RunOptions
from visup.sinks.webhook import Webhook
from visup.sinks.webhook_access import SIGNATURE, TIMESTAMP, WebhookAccess

Answer = Callable[[socket.socket], None]


@contextmanager
def server(answer: Answer) -> Iterator[tuple[str, list[bytes]]]:
    """A server that answers each connection so; it keeps what was sent to it."""
    got: list[bytes] = []

    def serve(listening: socket.socket) -> None:
        with suppress(OSError):
            while True:
                client, _ = listening.accept()
                with client, suppress(OSError):
                    got.append(request(client))
                    answer(client)

    with socket.create_server(("127.0.0.1", 0)) as listening:
        thread = threading.Thread(target=serve, args=(listening,), daemon=True)
        thread.start()
        yield f"http://127.0.0.1:{listening.getsockname()[1]}/hook", got
        listening.shutdown(socket.SHUT_RDWR)
    thread.join(10.0)


def request(client: socket.socket) -> bytes:
    client.settimeout(5.0)
    data = b""
    while b"\r\n\r\n" not in data or not data.endswith(b"}"):
        if not (part := client.recv(65536)):
            break
        data += part
    return data


def says(text: bytes) -> Answer:
    return lambda client: client.sendall(text)


def without_end(begin: bytes, more: bytes, pause_s: float = 0.0) -> Answer:
    def answer(client: socket.socket) -> None:
        client.sendall(begin)
        for _ in itertools.count():
            client.sendall(more)
            time.sleep(pause_s)

    return answer


def hook(url: str, timeout_s: float = 0.5) -> Webhook:
    return Webhook(url, timeout_s=timeout_s, tries=2, wait=lambda seconds: None)


@pytest.mark.parametrize("status", [301, 302, 303, 307, 308])
@pytest.mark.parametrize("scheme", ["http", "file", "ftp"])
def test_redirects_are_not_followed_and_count_as_failures(status: int, scheme: str) -> None:
    with server(says(b"HTTP/1.1 200 OK\r\nContent-Length: 0\r\n\r\n")) as (other, reached):
        place = other if scheme == "http" else f"{scheme}:///etc/passwd"
        answer = f"HTTP/1.1 {status} Moved\r\nLocation: {place}\r\nContent-Length: 0\r\n\r\n"
        with server(says(answer.encode())) as (url, asked):
            with pytest.raises(OSError, match=f"{status}.*not followed"):
                hook(url).deliver({"a": 1})
            assert len(asked) == 1
        assert not reached


@pytest.mark.parametrize(
    "answer",
    [
        without_end(b"HTTP/1.1 200 OK\r\n", b"X-More: and more\r\n"),
        without_end(b"HTTP/1.1 200 OK\r\nX: ", b"y"),
        without_end(b"", b"H", 0.05),
        without_end(b"HTTP/1.1 200 ", b"O", 0.05),
        says(b"nonsense\r\n\r\n"),
        says(b"HTTP/1.1 abc OK\r\n\r\n"),
        says(b""),
        lambda client: time.sleep(0.6),
    ],
)
def test_an_endless_response_times_out(answer: Answer) -> None:
    with server(answer) as (url, _):
        begin = time.monotonic()
        with pytest.raises(OSError, match=r"."):
            hook(url, timeout_s=0.2).deliver({"a": 1})
        assert time.monotonic() - begin < 4.0


@pytest.mark.parametrize(
    "answer",
    [
        without_end(b"HTTP/1.1 200 OK\r\n\r\n", b"body" * 1000),
        without_end(b"HTTP/1.1 200 OK\r\nContent-Length: 999999999999\r\n\r\n", b"x", 0.1),
        without_end(b"HTTP/1.1 204 OK\r\nTransfer-Encoding: chunked\r\n\r\n", b"1\r\nx\r\n", 0.1),
    ],
)
def test_response_bodies_are_not_read(answer: Answer) -> None:
    with server(answer) as (url, got):
        begin = time.monotonic()
        hook(url).deliver({"a": 1})
        assert time.monotonic() - begin < 2.0
        assert got[0].endswith(b'{"a":1}')


def test_words_of_the_server_are_not_repeated() -> None:
    with (
        server(says(b"HTTP/1.1 404 \x1b[2J\x1b]0;owned\x07\r\nContent-Length: 0\r\n\r\n")) as (
            url,
            _,
        ),
        pytest.raises(OSError, match="404") as told,
    ):
        hook(url).deliver({"a": 1})
    assert str(told.value) == "the server answered 404 (Not Found)"


def test_each_record_uses_a_new_connection() -> None:
    with server(says(b"HTTP/1.1 200 OK\r\nContent-Length: 0\r\n\r\n")) as (url, got):
        one = hook(url)
        for n in range(3):
            one.deliver({"n": n})
        one.close()
    assert [g[-7:] for g in got] == [b'{"n":0}', b'{"n":1}', b'{"n":2}']


def test_a_server_can_verify_sender_and_time_of_a_record() -> None:
    access = WebhookAccess({"Authorization": "Bearer marlin"}, key="swordfish")
    with server(says(b"HTTP/1.1 200 OK\r\nContent-Length: 0\r\n\r\n")) as (url, got):
        Webhook(url, access=access).deliver({"record": "alert"})
    head, _, body = got[0].partition(b"\r\n\r\n")
    headers = dict(line.split(": ", 1) for line in head.decode().split("\r\n")[1:])
    now = time.time()
    assert headers["Authorization"] == "Bearer marlin"
    timestamp = headers[TIMESTAMP]
    assert abs(int(timestamp) - now) < 30
    mac = hmac.new(b"swordfish", timestamp.encode() + b"." + body, hashlib.sha256)
    assert headers[SIGNATURE] == f"sha256={mac.hexdigest()}"


@given(st.binary(max_size=30), st.binary(max_size=30), st.integers(0, 10**10))
def test_another_body_or_time_has_another_signature(a: bytes, b: bytes, now: int) -> None:
    access = WebhookAccess(key="swordfish")
    one, other = access.headers_for(a, now), access.headers_for(b, now)
    assert (one == other) == (a == b)
    assert access.headers_for(a, now + 1)[SIGNATURE] != one[SIGNATURE]
    assert WebhookAccess(key="marlin").headers_for(a, now)[SIGNATURE] != one[SIGNATURE]


@pytest.mark.parametrize(
    ("headers", "key"),
    [
        ({"A b": "x"}, None),
        ({"": "x"}, None),
        ({"Content-Length": "1"}, None),
        ({"x-visup-signature": "1"}, None),
        ({"X-Key": "marlin\r\nHost: other"}, None),
        ({"X-Key": "mårlin"}, None),
        ({}, ""),
    ],
)
def test_invalid_headers_are_refused_without_showing_the_secret(
    headers: dict[str, str], key: str | None
) -> None:
    with pytest.raises(SettingsError) as refused:
        WebhookAccess(headers, key)
    assert "rlin" not in str(refused.value)


def test_headers_and_key_are_never_shown() -> None:
    assert "marlin" not in repr(WebhookAccess({"A": "marlin"}, "marlin"))
    assert "marlin" not in repr(RunOptions(webhook_headers={"A": "marlin"}, webhook_key="marlin"))

"""Messages by mail and chat: what they say, that the picture comes along, and that no password is shown."""

from __future__ import annotations

import email
import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import cv2
import numpy as np
import pytest

from visup.agent.model.errors import SettingsError
from visup.sinks.notification import Notification, body_of, title_of
from visup.sinks.registry import open_sink
from visup.sinks.webhook import DeliveryError

pytest.importorskip("apprise", reason="needs the extra `serve`")
ALERT = {
    "record": "alert",
    "state": "opened",
    "camera": "cell-2",
    "severity": "critical",
    "cause": "The arm touches the crate.",
    "at": "2026-05-04T07:12:33Z",
}


@contextmanager
def post_office() -> Iterator[tuple[int, list[str]]]:
    """A mail server that takes everything; it keeps the letters."""
    letters: list[str] = []

    def serve(listening: socket.socket) -> None:
        client, _ = listening.accept()
        with client, client.makefile("rw", encoding="utf-8", newline="\r\n") as talk:

            def say(line: str) -> None:
                talk.write(f"{line}\n")
                talk.flush()

            say("220 post")
            while word := talk.readline().rstrip().partition(" ")[0].upper():
                if word == "DATA":
                    say("354 go on")
                    letter = iter(talk.readline, ".\r\n")
                    letters.append("".join(letter))
                say("221 bye" if word == "QUIT" else "250 ok")

    with socket.create_server(("127.0.0.1", 0)) as listening:
        thread = threading.Thread(target=serve, args=(listening,), daemon=True)
        thread.start()
        yield listening.getsockname()[1], letters
        thread.join(10.0)


def test_a_mail_has_the_sentence_and_the_picture(tmp_path: Path) -> None:
    picture = tmp_path / "alert-1.jpg"
    cv2.imwrite(str(picture), np.zeros((8, 8, 3), np.uint8))
    with post_office() as (port, letters):
        address = (
            f"mailto://127.0.0.1:{port}?from=visup@cell.example&to=lead@cell.example&mode=insecure"
        )
        sink = Notification(address)
        sink.deliver({**ALERT, "snapshot": str(picture)})
        sink.close()
    letter = email.message_from_string(letters[0])
    assert "cell-2: critical" in str(letter["Subject"])
    parts = {p.get_content_type(): p for p in letter.walk()}
    assert parts["image/jpeg"].get_payload(decode=True) == picture.read_bytes()
    told = (p.get_payload(decode=True) for t, p in parts.items() if "text" in t)
    text = b"".join(t for t in told if isinstance(t, bytes))
    assert b"The arm touches the crate." in text
    assert b"2026-05-04T07:12:33Z" in text


def test_an_unreachable_server_is_reported_without_the_password() -> None:
    sink = Notification(
        "mailto://guard:swordfish@127.0.0.1:9?from=v@cell.example&to=lead@cell.example&mode=insecure"
    )
    assert sink.name == "notify:mailto"
    with pytest.raises(DeliveryError) as told:
        sink.deliver(ALERT)
    assert "swordfish" not in str(told.value)


@pytest.mark.parametrize("address", ["", "nowhere", "slack://swordfish", "nosuch://swordfish/x"])
def test_an_unknown_address_is_refused_without_showing_it(address: str) -> None:
    with pytest.raises(SettingsError) as told:
        open_sink(f"notify:{address}")
    assert "swordfish" not in str(told.value)


@pytest.mark.parametrize(
    ("record", "title", "said"),
    [
        (ALERT, "cell-2: critical", "The arm touches the crate."),
        ({**ALERT, "state": "closed"}, "cell-2: over: critical", "The arm touches the crate."),
        ({"record": "notice", "source": "0", "text": "The disk is full."}, "0: notice", "The disk is full."),
        (
            {"record": "verdict", "camera": "yard", "verdict": "failed", "steps": 90},
            "yard: the run has ended",
            "Verdict: failed, after 90 steps.",
        ),
    ],
)  # fmt: skip
def test_messages_have_title_and_body(record: dict[str, object], title: str, said: str) -> None:
    assert title_of(record) == title
    assert body_of(record).splitlines()[0] == said

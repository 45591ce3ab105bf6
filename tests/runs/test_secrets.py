"""Passwords of a source reach nothing that is written, printed or sent."""

from __future__ import annotations

import functools
import http.server
import threading
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from tests.cli import Call, caller
from tests.clips import moving_disc, write_clip
from tests.runs.test_resume import BARE, broken_run, outcome
from visup.agent.model.errors import SettingsError
from visup.agent.storage.journal_reader import Recording
from visup.runs.resume import interrupted_run
from visup.runs.runner import fresh_folder, supervise
from visup.runs.settings import WatchSettings

WORDS = ("swordfish77", "marlin99")


class Quiet(http.server.SimpleHTTPRequestHandler):
    def log_message(self, *given: object) -> None:
        pass

    def do_POST(self) -> None:
        body = self.rfile.read(int(self.headers["Content-Length"]))
        self.server.bodies.append(body)  # type: ignore[attr-defined]
        self.send_response(200)
        self.send_header("Content-Length", "0")
        self.end_headers()


@pytest.fixture
def server(tmp_path: Path) -> Iterator[http.server.ThreadingHTTPServer]:
    folder = tmp_path / "www"
    folder.mkdir()
    write_clip(folder / "disc.avi", moving_disc(20), fps=20.0)
    handler = functools.partial(Quiet, directory=str(folder))
    made = http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler)
    made.bodies = []  # type: ignore[attr-defined]
    threading.Thread(target=made.serve_forever, args=(0.02,), daemon=True).start()
    yield made
    made.shutdown()
    made.server_close()


def address(server: http.server.ThreadingHTTPServer) -> str:
    name, token = WORDS
    return f"http://guard:{name}@127.0.0.1:{server.server_port}/disc.avi?token={token}"


@pytest.fixture
def visup(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str], tmp_path: Path
) -> Call:
    monkeypatch.chdir(tmp_path)
    return caller(monkeypatch, capfd)


def leaks(*texts: bytes, folder: Path) -> list[str]:
    """Where a password stands: in names or bytes of files, or in a text."""
    files = [p for p in folder.rglob("*") if p.is_file()]
    assert files
    told = {str(p.relative_to(folder)): p.read_bytes() + bytes(p) for p in files}
    told |= {f"text {i}": text for i, text in enumerate(texts)}
    return [f"{where}: {w}" for where, text in told.items() for w in WORDS if w.encode() in text]


def test_the_password_of_a_source_is_not_recorded(
    visup: Call,
    server: http.server.ThreadingHTTPServer,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("visup.sinks.webhook.INITIAL_WAIT_S", 0.05)
    hook = f"webhook:http://guard:{WORDS[0]}@127.0.0.1:{server.server_port}/{WORDS[1]}"
    lost = f"webhook:http://127.0.0.1:1/services/{WORDS[1]}"
    sinks = ["--sink", hook, "--sink", lost, "--sink", "file:alerts.jsonl"]
    done = visup("watch", address(server), "--verbose", *sinks)
    assert done.code == 5  # one of the sinks is down, and named
    assert "http://127.0.0.1:1/..." in done.out
    bodies: list[bytes] = server.bodies  # type: ignore[attr-defined]
    assert bodies
    assert leaks(done.out.encode(), done.err.encode(), *bodies, folder=tmp_path) == []
    run = tmp_path / "runs" / "disc"
    assert f"127.0.0.1:{server.server_port}/disc.avi" in (run / "report.html").read_text()
    assert "127.0.0.1" in Recording.open(run).facts()["source"]


@pytest.mark.parametrize("words", [["watch"], ["check"], ["check", "--task", "dock"]])
def test_errors_of_a_source_do_not_show_its_password(
    visup: Call, server: http.server.ThreadingHTTPServer, tmp_path: Path, words: list[str]
) -> None:
    where = address(server)
    if "--task" not in words:
        where = where.replace("disc", "none")
    done = visup(*words[:1], where, *words[1:])
    assert done.code == 2
    assert leaks(done.out.encode(), done.err.encode(), folder=tmp_path) == []


@pytest.mark.parametrize("sink", ["webhok:https://a:{}@b/", "webhook:ftp://a:{}@b/"])
def test_errors_of_a_sink_do_not_show_its_password(visup: Call, tmp_path: Path, sink: str) -> None:
    clip = write_clip(tmp_path / "clip.avi", moving_disc(2))
    done = visup("watch", clip, "--sink", sink.format(WORDS[0]))
    assert done.code == 2
    assert WORDS[0] not in done.out + done.err


def test_resuming_needs_the_password_again(
    server: http.server.ThreadingHTTPServer, tmp_path: Path
) -> None:
    settings = WatchSettings(source=address(server))
    whole, parts = tmp_path / "whole", tmp_path / "parts"
    supervise(settings, fresh_folder(whole, ""), options=BARE)
    broken_run(settings, parts, 12, BARE)
    with pytest.raises(SettingsError, match="had a password"):
        interrupted_run(parts)
    with pytest.raises(SettingsError, match="not the source of the run"):
        interrupted_run(parts, source="rtsp://guard:word@elsewhere/1")
    past = interrupted_run(parts, source=settings.source)
    assert past.settings == replace(settings, actors={})
    supervise(past.settings, parts, options=BARE, past=past)
    assert outcome(parts) == outcome(whole)


def test_the_command_accepts_the_source_with_its_password(
    visup: Call, server: http.server.ThreadingHTTPServer, tmp_path: Path
) -> None:
    broken_run(WatchSettings(source=address(server)), tmp_path / "run", 12, BARE)
    refused = visup("watch", "--resume", "run")
    assert refused.code == 2
    assert "visup watch ADDRESS --resume run" in refused.err
    assert visup("watch", address(server), "--resume", "run", "--no-video").code == 0


def test_resuming_a_run_without_a_password_takes_no_source(visup: Call, tmp_path: Path) -> None:
    clip = write_clip(tmp_path / "clip.avi", moving_disc(20))
    broken_run(WatchSettings(source=str(clip)), tmp_path / "run", 12, BARE)
    assert visup("watch", clip, "--resume", "run").code == 2

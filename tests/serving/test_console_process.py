"""The console beside the cameras: begun, begun again, ended; it has tokens that nobody else sees."""

from __future__ import annotations

import socket
import subprocess
import sys
import time
import urllib.error
import urllib.request
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import pytest

from tests.archive.recordings import meeting, record
from tests.serving.fakes import Bench, site_camera
from visup.serving.console_process import (
    ConsoleProcess,
    console_command,
    console_environment,
    start_process,
)
from visup.serving.site.records import Site, SiteConsole
from visup.serving.site_log import SiteEvent
from visup.serving.site_supervisor import SiteSupervisor

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="services need POSIX signals")

CONSOLE = SiteConsole(("127.0.0.1", 8086), "swordfish-and-marlin", "only-looking-at-it")


class Scene:
    """A site without cameras at work; its console is a process that sleeps."""

    def __init__(self, folder: Path) -> None:
        self.bench, self.now = Bench(), 0.0
        self.site = Site(folder / "s.toml", folder, (site_camera(),), console=CONSOLE)
        self.supervisor = SiteSupervisor(self.site, self.bench.tell, self.bench.start)
        self.console = ConsoleProcess(folder, self.bench.tell, self.begin)
        self.begun: list[subprocess.Popen[bytes]] = []

    def begin(self, command: Sequence[str], tokens: Mapping[str, str]) -> subprocess.Popen[bytes]:
        self.begun.append(
            start_process((sys.executable, "-c", "import time; time.sleep(60)"), tokens)
        )
        return self.begun[-1]

    def tick(self, later_s: float = 0.1) -> None:
        self.now += later_s
        self.console.tick(self.supervisor, self.now)

    def kill(self) -> None:
        self.begun[-1].kill()
        self.begun[-1].wait()


@pytest.fixture
def scene(tmp_path: Path) -> Scene:
    return Scene(tmp_path)


def test_it_is_restarted_with_growing_waits_and_no_camera_is_affected(scene: Scene) -> None:
    scene.tick()
    scene.tick()
    assert len(scene.begun) == 1
    for wait in (1.0, 2.0, 4.0):
        scene.kill()
        scene.tick()
        assert scene.bench.lines[-1].endswith(
            f"the console ended (signal 9); restarting in {wait:g} s"
        )
        scene.tick(wait - 0.2)
        count = len(scene.begun)
        scene.tick(0.4)
        assert len(scene.begun) == count + 1
    assert scene.bench.children == []
    assert scene.bench.kinds.count(SiteEvent.CONSOLE_ENDED) == 3
    scene.console.close()
    assert all(process.poll() is not None for process in scene.begun)


def test_changes_of_the_site_file_apply_to_the_console(scene: Scene) -> None:
    scene.tick()
    changed = replace(scene.site, console=replace(CONSOLE, listen=("127.0.0.1", 8087)))
    scene.supervisor.reload(changed, scene.now)
    scene.tick()
    assert scene.begun[0].poll() is not None
    assert len(scene.begun) == 2
    assert scene.bench.lines[-1].endswith("the console is at http://127.0.0.1:8087/")
    scene.supervisor.reload(replace(scene.site, console=None), scene.now)
    scene.tick()
    assert scene.begun[1].poll() is not None
    scene.tick(99.0)
    assert len(scene.begun) == 2


def test_a_console_that_cannot_start_stops_nothing(tmp_path: Path) -> None:
    scene = Scene(tmp_path)

    def fail(command: Sequence[str], tokens: Mapping[str, str]) -> subprocess.Popen[bytes]:
        raise OSError(12, "Cannot allocate memory")

    scene.console = ConsoleProcess(tmp_path, scene.bench.tell, fail)
    scene.tick()
    assert "cannot be started (Cannot allocate memory)" in scene.bench.lines[-1]


def test_tokens_appear_neither_in_the_command_nor_in_the_log(scene: Scene) -> None:
    console = replace(CONSOLE, names=("cell.example",), save_to=Path("own"))
    command = console_command(console, Path("store"))
    assert command[-6:] == ("--port", "8086", "--name", "cell.example", "--save-to", "own")
    scene.tick()
    scene.console.close()
    for token in (CONSOLE.token, CONSOLE.viewer_token or ""):
        assert token in console_environment(console).values()
        assert token not in " ".join(command)
        assert token not in "".join(scene.bench.lines)


def test_a_real_console_answers_and_ends_with_its_service(tmp_path: Path) -> None:
    pytest.importorskip("nicegui", reason="needs the extra `console`")
    record(tmp_path / "cell" / "one", meeting(5))
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    console = replace(CONSOLE, listen=("127.0.0.1", port))
    process = start_process(console_command(console, tmp_path), console_environment(console))
    cookie = {"Cookie": f"visup_console={CONSOLE.viewer_token}"}
    asked = urllib.request.Request(f"http://127.0.0.1:{port}/", headers=cookie)
    try:
        end, page = time.monotonic() + 60.0, b""
        while not page and time.monotonic() < end and process.poll() is None:
            try:
                with urllib.request.urlopen(asked, timeout=20) as answer:
                    page = answer.read()
            except urllib.error.URLError:
                time.sleep(0.05)
        assert b"visup" in page
        assert process.stdin is not None
        process.stdin.close()  # as when the service is killed
        process.wait(20)
    finally:
        process.kill()
        process.wait()

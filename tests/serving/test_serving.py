"""`visup serve` with real processes: one is killed and comes back as it was, the other never notices."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import time
import urllib.request
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest

from tests.cli import Call, caller
from tests.clips import moving_disc, write_clip
from tests.paths import ROOT
from visup.agent.storage.journal_reader import JOURNAL, Recording
from visup.serving.run_store import CURRENT

RULE = 'rule seen(a): warning\n    when in_view(a) > 0.2 s\n    say "{a} {is} seen."\n'
CAMERA = '[[camera]]\nname = "{0}"\nsource = "loop:{0}.avi"\nrules = ["own.rules"]\n'
HEAD = """store = "store"
sinks = ["file:alerts.jsonl"]
recording.state_every = 1.0
monitoring.listen = "127.0.0.1:0"
evidence = { before_s = 1.0, after_s = 0.5 }
"""
pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="processes are found in /proc")


@pytest.fixture
def visup(monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> Call:
    return caller(monkeypatch, capfd)


@pytest.fixture
def site(tmp_path: Path) -> Path:
    for name in ("one", "two", "three"):
        write_clip(tmp_path / f"{name}.avi", moving_disc(40), fps=20.0)
    (tmp_path / "own.rules").write_text(RULE)
    path = tmp_path / "site.toml"
    path.write_text(HEAD + CAMERA.format("one") + CAMERA.format("two"))
    return path


class Service:
    """A service that runs."""

    def __init__(self, process: subprocess.Popen[bytes], site: Path) -> None:
        self.process = process
        self.site = site
        self.store = site.parent / "store"

    def pid_of(self, camera: str) -> int:
        """Of the process that has the camera's journal open."""
        for folder in Path("/proc").glob("[0-9]*/fd"):
            with suppress(OSError):
                if any(f"/store/{camera}/" in str(fd.readlink()) for fd in folder.iterdir()):
                    return int(folder.parent.name)
        return 0

    def run(self, camera: str) -> Path:
        told = json.loads((self.store / camera / CURRENT).read_text())
        return self.store / camera / str(told["run"])

    def frames(self, camera: str) -> list[int]:
        """Numbers of the frames that are recorded."""
        try:
            if not (self.run(camera) / JOURNAL).is_file():
                return []
            return [s["frame_index"] for s in Recording.open(self.run(camera)).summaries()]
        except FileNotFoundError:
            return []

    def has_states(self, *cameras: str) -> bool:
        """Whether a state of each camera was kept."""
        return all(list((self.store / c).glob("*/state.bin")) for c in cameras)

    def wait_for(self, what: Callable[[], object], seconds: float = 60.0) -> None:
        end = time.monotonic() + seconds
        while not what():
            assert self.process.poll() is None, "the service ended"
            assert time.monotonic() < end, "it did not come in time"
            time.sleep(0.05)

    @property
    def log(self) -> str:
        return (self.site.parent / "log").read_text()


@contextmanager
def serving(site: Path, *words: str) -> Iterator[Service]:
    with (site.parent / "log").open("ab") as log:
        process = subprocess.Popen(
            [sys.executable, "-m", "visup.cli", "serve", str(site), *words],
            stderr=log,
            env={**os.environ, "PYTHONPATH": str(ROOT)},
        )
    try:
        yield Service(process, site)
    finally:
        process.kill()
        process.wait()


def test_a_killed_camera_comes_back_and_the_others_are_unaffected(visup: Call, site: Path) -> None:
    with serving(site) as service:
        service.wait_for(lambda: service.has_states("one", "two"))
        victim, other = service.pid_of("one"), service.pid_of("two")
        run, before = service.run("one"), service.frames("one")
        os.kill(victim, signal.SIGKILL)
        killed = time.monotonic()
        service.wait_for(lambda: len(service.frames("one")) > len(before) + 20)
        assert time.monotonic() - killed < 10.0 * patience()
        assert service.run("one") == run
        assert service.pid_of("two") == other
        frames_seen_and_restarts_are_told(service)

        assert visup("serve", site).code == 2  # a store has one service
        exchange(site, "one", "three")
        os.kill(service.process.pid, signal.SIGHUP)
        service.wait_for(lambda: "three: starts run" in service.log)
        service.wait_for(lambda: "one: verdict" in service.log)
        assert service.pid_of("two") == other

        stopped = time.monotonic()
        service.process.send_signal(signal.SIGTERM)
        code = service.process.wait(timeout=30)
        assert code == 0 or (code == 5 and patience() > 2.0)
        assert time.monotonic() - stopped < 6.0 * patience()
    frames = service.frames("one")
    assert frames == sorted(set(frames))
    assert frames[: len(before)] == before
    assert "one: its process died (signal 9)" in service.log
    assert f"one: resumes run {run.name}" in service.log
    assert Recording.open(service.run("two")).facts()["ended"] == "stopped"
    assert (service.run("two") / "events.jsonl").stat().st_size > 0
    alerts_are_told_once(site.parent / "alerts.jsonl")
    alerts_have_evidence(site.parent / "alerts.jsonl")


def frames_seen_and_restarts_are_told(service: Service) -> None:
    pytest.importorskip("prometheus_client", reason="needs the extra `serve`")
    (address,) = re.findall(r"http://\S+/metrics", service.log)
    with urllib.request.urlopen(address, timeout=5) as answer:
        page = answer.read().decode()
    assert 'visup_restarts_total{camera="one"} 1.0' in page
    assert 'visup_restarts_total{camera="two"} 0.0' in page
    (seen,) = re.findall(r'visup_frames_seen_total\{camera="two"\} (\S+)', page)
    assert float(seen) > 10


def alerts_have_evidence(path: Path) -> None:
    told = [json.loads(line) for line in path.read_text().splitlines()]
    opened = [t for t in told if t["record"] == "alert" and t["state"] == "opened"]
    assert opened
    for record in opened:
        assert Path(record["snapshot"]).stat().st_size > 100
        clip = Path(record["clip"])
        # Of an alert in the last moment it is made when the run is taken up again.
        assert clip.is_file() or clip.with_suffix(".spool").is_file()


def exchange(site: Path, gone: str, new: str) -> None:
    """One camera goes, one comes, all others stay."""
    site.write_text(site.read_text().replace(CAMERA.format(gone), "") + CAMERA.format(new))


def alerts_are_told_once(path: Path) -> None:
    told = [json.loads(line) for line in path.read_text().splitlines()]
    alerts = [(t["source"], t["id"], t["state"]) for t in told if t["record"] == "alert"]
    assert {Path(source).stem for source, _, _ in alerts} >= {"one", "two"}
    assert sorted(alerts) == sorted(set(alerts))


def patience() -> float:
    """A machine that does much else is slower."""
    return max(1.0, os.getloadavg()[0] / (os.cpu_count() or 1))

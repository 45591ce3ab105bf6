"""All cameras of a site: the file changes, and only who changed is touched."""

from __future__ import annotations

import json
import os
import socket
import time
from pathlib import Path

import pytest

from tests.clips import moving_disc, write_clip
from tests.serving.fakes import Bench, ThreadChild, site_camera
from visup.agent.model.errors import OutputError
from visup.agent.storage.file_lock import acquire_lock
from visup.percepts.video.waiting_clock import WaitingClock
from visup.runs.inputs.stop_signals import StopRequest
from visup.runs.result import ExitCode
from visup.serving.reports import ReportKind
from visup.serving.site.records import Site, SiteCamera
from visup.serving.site_log import SiteLog
from visup.serving.site_supervisor import SiteSupervisor, serve_site


def site(store: Path, *cameras: SiteCamera) -> Site:
    return Site(store / "site.toml", store, cameras)


def test_only_changed_cameras_are_restarted(tmp_path: Path) -> None:
    bench = Bench()
    same, changed, gone = (site_camera(name) for name in ("same", "changed", "gone"))
    supervisor = SiteSupervisor(site(tmp_path, same, changed, gone), bench.tell, bench.start)
    supervisor.tick(0.0)
    first = {c.job.folder.parent.name: c for c in bench.children}
    new = site_camera("new")
    other = site_camera("changed", source="1", fingerprint="b")
    supervisor.reload(site(tmp_path, other, site_camera("same"), new), 1.0)
    for turn in range(5):
        supervisor.tick(1.0 + turn)
    running = {c.job.folder.parent.name: c for c in bench.running}
    assert set(running) == {"same", "changed", "new"}
    assert running["same"] is first["same"]
    assert first["same"].asked == 0
    assert running["changed"].job.settings.source == "1"
    assert first["gone"].asked == 1
    assert first["gone"].closed
    assert not supervisor.over
    supervisor.stop(9.0)
    supervisor.tick(9.1)
    assert supervisor.over
    assert supervisor.closed_cleanly


@pytest.mark.parametrize(("cores", "cameras", "threads"), [(8, 2, 4), (2, 3, 1), (None, 1, 1)])
def test_cameras_share_the_cores(
    cores: int | None, cameras: int, threads: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(os, "cpu_count", lambda: cores)
    bench = Bench()
    all_of_them = [site_camera(f"camera{n}") for n in range(cameras)]
    SiteSupervisor(site(tmp_path, *all_of_them), bench.tell, bench.start).tick(0.0)
    assert [c.job.threads for c in bench.children] == [threads] * cameras


class Script:
    """A clock whose every tick does the next thing."""

    def __init__(self, *acts: object) -> None:
        self.acts = list(acts)
        self.now = 0.0

    def wait(self, seconds: float) -> None:
        self.now += seconds
        if self.acts:
            act = self.acts.pop(0)
            if callable(act):
                act()

    @property
    def clock(self) -> WaitingClock:
        return WaitingClock(lambda: self.now, self.wait)


def test_files_are_watched_to_their_end_and_the_log_can_be_json(tmp_path: Path) -> None:
    clip = write_clip(tmp_path / "one.avi", moving_disc(40), fps=20.0)
    lines: list[str] = []
    one = site_camera("one", source=str(clip))
    code = serve_site(
        site(tmp_path, one),
        SiteLog(lines.append, as_json=True),
        StopRequest(),
        ThreadChild,
        WaitingClock(wait=lambda seconds: time.sleep(0.02)),
    )
    assert code is ExitCode.GOOD
    told = [json.loads(line) for line in lines]
    assert [(t["camera"], t["kind"], t["level"]) for t in told] == [
        ("one", "begun", "info"),
        ("one", "ended", "info"),
    ]
    assert told[1]["text"].startswith("verdict none after 40 frames")
    assert told[0]["time"].endswith("Z")
    assert told[0]["run"] == next((tmp_path / "one").glob("2*")).name


def test_a_stop_ends_all_cameras_and_notifies_the_service_manager(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    bench, stop = Bench(), StopRequest()
    place = str(tmp_path / "manager")
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as manager:
        manager.bind(place)
        manager.setblocking(False)
        monkeypatch.setenv("NOTIFY_SOCKET", place)
        script = Script(None, lambda: setattr(stop, "received", True))
        code = serve_site(
            site(tmp_path, site_camera("a"), site_camera("b")),
            bench.tell,
            stop,
            bench.start,
            script.clock,
        )
        heard = []
        while True:
            try:
                heard.append(manager.recv(100).decode())
            except BlockingIOError:
                break
    assert code is ExitCode.GOOD
    assert heard[0] == "READY=1"
    assert "WATCHDOG=1" in heard
    assert "STOPPING=1" in heard
    assert all(c.closed for c in bench.children)


def test_a_process_that_does_not_close_sets_the_exit_code(tmp_path: Path) -> None:
    bench, stop = Bench(), StopRequest(received=True)
    script = Script(lambda: setattr(bench.last, "stubborn", True))

    def start(job: object) -> object:
        child = bench.start(job)  # type: ignore[arg-type]
        child.stubborn = True
        return child

    code = serve_site(
        site(tmp_path, site_camera()),
        bench.tell,
        stop,
        start,  # type: ignore[arg-type]
        script.clock,
    )
    assert code is ExitCode.NOT_RECORDED


def test_a_service_ends_when_all_sources_have_ended(tmp_path: Path) -> None:
    bench = Bench()

    def end() -> None:
        bench.last.tell(ReportKind.ENDED, live=False, steps=3)
        bench.last.code = 0

    script = Script(end)
    code = serve_site(
        site(tmp_path, site_camera()), bench.tell, StopRequest(), bench.start, script.clock
    )
    assert code is ExitCode.GOOD


def test_a_file_with_mistakes_changes_nothing(tmp_path: Path) -> None:
    bench, stop = Bench(), StopRequest()
    (tmp_path / "site.toml").write_text("[[camera]]\nnaem = 'x'\n")
    script = Script(
        lambda: setattr(stop, "reload", True), None, lambda: setattr(stop, "received", True)
    )
    serve_site(site(tmp_path, site_camera()), bench.tell, stop, bench.start, script.clock)
    assert any("did you mean 'name'?" in line for line in bench.lines)
    assert len(bench.children) == 1
    assert not stop.reload


def test_a_store_has_one_service(tmp_path: Path) -> None:
    lock = acquire_lock(tmp_path / "visup-serve", "the runs of this store")
    try:
        with pytest.raises(OutputError, match="another visup"):
            serve_site(site(tmp_path, site_camera()), Bench().tell, StopRequest())
    finally:
        lock.release()


def test_a_store_that_cannot_be_created_is_reported(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match="store cannot be written"):
        serve_site(site(tmp_path / "file" / "x", site_camera()), Bench().tell, StopRequest())
    assert os.listdir(tmp_path) == ["file"]  # noqa: PTH208

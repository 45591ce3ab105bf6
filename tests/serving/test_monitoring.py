"""How a service does is told: sums never go back, whoever hangs costs nothing, nobody beyond is asked."""

from __future__ import annotations

import json
import socket
import urllib.error
import urllib.request
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.serving.fakes import Bench, site_camera
from visup.agent.model.errors import OutputError
from visup.serving.camera_supervisor import CameraSupervisor
from visup.serving.monitoring.camera_figures import CameraFigures
from visup.serving.monitoring.endpoint import MonitoringServer
from visup.serving.monitoring.prometheus import metrics_page
from visup.serving.monitoring.status import STALE_S, CameraStatus, SiteStatus
from visup.serving.reports import ReportKind

LIVES = st.lists(st.lists(st.integers(0, 1000), max_size=5).map(sorted), max_size=5)


@given(LIVES)
def test_totals_over_processes_never_decrease(lives: list[list[int]]) -> None:
    figures, last = CameraFigures(), 0.0
    for life in lives:
        for count in life:
            figures.update({"frames": count, "objects": 3, "text": "x", "lag_s": None})
            assert figures.totals["frames"] >= last
            last = figures.totals["frames"]
        figures.process_ended()
        assert figures.latest == {}
        assert figures.totals.get("frames", 0.0) == last
    assert last == sum(max(life, default=0) for life in lives)


def test_reports_of_a_process_appear_in_the_metrics(tmp_path: Path) -> None:
    bench = Bench()
    one = CameraSupervisor(site_camera(), tmp_path, bench.tell, bench.start)
    one.tick(0.0)
    assert one.status(0.0).state == "starting"
    bench.last.tell(ReportKind.STEP, frames=5, dropped=1, lag_s=0.25, ms_perceive=40.0)
    one.tick(1.0)
    bench.last.kill()
    one.tick(2.0)
    one.tick(4.0)
    bench.last.tell(ReportKind.STEP, frames=2, dropped=0, lag_s=0.5, ms_perceive=10.0)
    one.tick(5.0)
    status = one.status(7.0)
    assert (status.state, status.restarts, status.step_age_s) == ("watching", 1, 2.0)
    assert status.totals == {"frames": 7.0, "dropped": 1.0, "ms_perceive": 50.0}
    assert status.latest == {"lag_s": 0.5}


def site(*cameras: CameraStatus) -> SiteStatus:
    return SiteStatus(100.0, cameras, {"free": 5e9}, {"evidence": 2.0})


CELL = CameraStatus(
    "cell",
    "watching",
    restarts=2,
    memory_mb=100.0,
    step_age_s=0.1,
    totals={"frames": 7.0, "dropped": 1.0, "alerts_warning": 3.0, "ms_perceive": 50.0},
    latest={"lag_s": 0.5, "objects": 2.0, "alerts_open": 1.0},
)


def test_prometheus_can_parse_the_metrics() -> None:
    parser = pytest.importorskip("prometheus_client.parser", reason="needs the extra `serve`")
    page, kind = metrics_page(site(CELL, CameraStatus("yard", "starting")), "")
    assert kind.startswith("text/plain")
    samples = {
        (s.name, *sorted(s.labels.values())): s.value
        for family in parser.text_string_to_metric_families(page.decode())
        for s in family.samples
    }
    assert samples["visup_frames_seen_total", "cell"] == 7.0
    assert samples["visup_frames_dropped_total", "cell"] == 1.0
    assert samples["visup_phase_seconds_total", "cell", "perceive"] == 0.05
    assert samples["visup_alerts_total", "cell", "warning"] == 3.0
    assert samples["visup_alerts_total", "cell", "critical"] == 0.0
    assert samples["visup_memory_bytes", "cell"] == 100 * 2**20
    assert samples["visup_camera_ready", "yard"] == 0.0
    assert samples["visup_store_bytes", "free"] == 5e9
    assert samples["visup_store_deleted_total", "evidence"] == 2.0
    assert ("visup_lag_seconds", "yard") not in samples


class Clock:
    now = 100.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def server() -> Iterator[MonitoringServer]:
    made = MonitoringServer("127.0.0.1", 0, Clock())
    yield made
    made.close()


def test_ready_means_watching_and_healthy_means_recently_updated(server: MonitoringServer) -> None:
    server.status = site(CELL, CameraStatus("yard", "starting"))
    assert server.answer("/healthz")[0] == 200
    status, body, _ = server.answer("/readyz")
    assert status == 503
    assert json.loads(body)["cameras"] == {"cell": "watching", "yard": "starting"}
    server.status = site(CELL, CameraStatus("yard", "over"))
    assert server.answer("/readyz")[0] == 200
    Clock.now += STALE_S
    assert server.answer("/healthz")[0] == server.answer("/readyz")[0] == 503
    Clock.now = 100.0


def asked(server: MonitoringServer, path: str, method: str = "GET") -> tuple[int, bytes]:
    request = urllib.request.Request(f"http://{server.address}{path}", method=method)
    try:
        with urllib.request.urlopen(request, timeout=5) as answer:
            return answer.status, answer.read()
    except urllib.error.HTTPError as refused:
        with refused:
            return refused.code, refused.read()


def test_it_answers_while_other_clients_hang_and_serves_no_other_path(
    server: MonitoringServer,
) -> None:
    host, port = server.address.split(":")
    hanging = [socket.create_connection((host, int(port))) for _ in range(3)]
    assert asked(server, "/healthz?x=1")[0] == 200
    assert asked(server, "/healthz", "HEAD") == (200, b"")
    for path in ("/", "/../etc/passwd", "/metrics/x"):
        assert asked(server, path)[0] == 404
    assert asked(server, "/healthz", "POST")[0] == 501
    for one in hanging:
        one.close()


def test_an_address_in_use_is_reported(server: MonitoringServer) -> None:
    host, port = server.address.split(":")
    with pytest.raises(OutputError, match="nobody can be told") as told:
        MonitoringServer(host, int(port))
    assert told.value.where == server.address

"""Sinks: what they are told, and that nothing waits for them."""

from __future__ import annotations

import http.server
import io
import json
import socket
import struct
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.clips import moving_disc, write_clip
from visup.agent import Alert, Frame, Mind, Observation, Report, ReportState, Severity, Verdict
from visup.agent.model.errors import ExtraMissingError, OutputError, SettingsError
from visup.agent.model.step import Step
from visup.evaluation.runtime.soak import evaluate_soak, sinks_ratio
from visup.runs.runner import fresh_folder, supervise
from visup.runs.settings import RunOptions, WatchSettings
from visup.sinks import Outbox, Sinks, open_sink
from visup.sinks.lines import JsonLines
from visup.sinks.webhook import Webhook

ALERT = Alert(3, "worry", Severity.WARNING, 1.0, 1.5, (1, 2), "This is a worry.", ("because",))
FRAME = Frame(7, 1.5, np.zeros((4, 6, 3), np.uint8))


def step(*alerts: Alert) -> Step:
    report = Report("eye", ReportState.RAN, ("x",), elapsed_ms=2.0)
    return Step(7, 1.5, Observation(7, 1.5, (6, 4), (report,)), Mind(), alerts=alerts)


class Slow:
    """A sink that takes nothing until it is let."""

    name = "slow:x"

    def __init__(self) -> None:
        self.gate = threading.Event()
        self.got: list[Any] = []
        self.closed = False

    def deliver(self, record: Any) -> None:
        self.gate.wait(10.0)
        self.got.append(record)

    def close(self) -> None:
        self.closed = True


def test_a_slow_sink_blocks_no_step_and_its_dropped_records_are_reported() -> None:
    slow = Slow()
    box = Outbox(slow, max_length=5)
    begin = time.perf_counter()
    for n in range(100):
        box.offer(n)
    assert time.perf_counter() - begin < 1.0
    assert box.dropped in (94, 95)  # one may be in the sink's hands already
    (trouble,) = box.runtime_faults()
    assert (trouble.kind, trouble.key) == ("sink_failed", "slow:x")
    slow.gate.set()
    box.close()
    assert slow.got == list(range(100 - box.dropped))
    assert slow.closed
    assert "dropped" in (box.note or "")


class Failing:
    name = "failing:x"

    def __init__(self, bad: set[int]) -> None:
        self.bad = bad

    def deliver(self, record: int) -> None:
        if record in self.bad:
            raise ValueError("no")

    def close(self) -> None:
        raise RuntimeError("not even that")


def test_a_failing_sink_is_retried_with_the_next_record() -> None:
    box = Outbox(Failing({1, 3}))
    for n in range(5):
        box.offer(n)
    box.close()
    assert (box.delivered, box.failed, box.dropped) == (3, 2, 0)
    assert "not even that" in box.fault


def test_a_sink_that_never_answers_does_not_delay_the_end() -> None:
    slow = Slow()
    box = Outbox(slow)
    for n in range(10):
        box.offer(n)
    box.close(wait_s=0.2)
    assert box.dropped == 10  # with the one that is in the sink's hands
    box.close(wait_s=0.0)
    assert box.dropped == 10
    slow.gate.set()


def test_alerts_and_the_verdict_go_to_a_file(tmp_path: Path) -> None:
    path = tmp_path / "alerts.jsonl"
    path.write_text("what was there\n")
    sinks = Sinks([f"file:{path}"], "clip.mp4")
    sinks(step(ALERT), FRAME)
    sinks(step(), FRAME)
    assert sinks.end(Verdict.FAILED, 9) == ()
    kept, alert, verdict = path.read_text().splitlines()
    assert kept == "what was there"
    told = json.loads(alert)
    assert (told["record"], told["state"], told["id"]) == ("alert", "opened", 3)
    assert (told["source"], told["severity"], told["objects"]) == ("clip.mp4", "warning", [1, 2])
    assert json.loads(verdict)["verdict"] == "failed"


def test_standard_output_gets_one_object_a_line() -> None:
    out = io.StringIO()
    sink = JsonLines("jsonl:-", out)
    sink.deliver({"b": 1, "a": "ä"})
    assert out.getvalue() == '{"a":"ä","b":1}\n'


@contextmanager
def server(*codes: int) -> Iterator[tuple[str, list[bytes]]]:
    """A web server that answers with these codes, then 200."""
    bodies: list[bytes] = []
    left = list(codes)

    class Handler(http.server.BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            bodies.append(self.rfile.read(int(self.headers["Content-Length"])))
            self.send_response(left.pop(0) if left else 200)
            self.end_headers()

        def log_message(self, *_: object) -> None:
            pass

    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler) as web:
        thread = threading.Thread(target=web.serve_forever, args=(0.02,))
        thread.start()
        yield f"http://127.0.0.1:{web.server_address[1]}/x", bodies
        web.shutdown()
        thread.join()


@pytest.mark.parametrize(
    ("codes", "posts", "fails"),
    [((), 1, False), ((503, 429), 3, False), ((404,), 1, True), ((500,) * 9, 4, True)],
)
def test_a_webhook_is_retried_after_server_errors(
    codes: tuple[int, ...], posts: int, fails: bool
) -> None:
    waited: list[float] = []
    with server(*codes) as (url, bodies):
        hook = Webhook(url, wait=waited.append)
        if fails:
            with pytest.raises(OSError, match=str(codes[0])):
                hook.deliver({"a": 1})
        else:
            hook.deliver({"a": 1})
    assert [json.loads(b) for b in bodies] == [{"a": 1}] * posts
    assert waited == [0.5, 1.0, 2.0][: posts - 1]


def test_an_unreachable_webhook_finally_fails() -> None:
    hook = Webhook("http://127.0.0.1:9/", wait=lambda s: None)
    with pytest.raises(OSError, match="refused"):
        hook.deliver({})


@pytest.mark.parametrize(
    "wanted",
    ["", "x", "file:", "jsonl:x", "webhook:ftp://x", "tape:x", "mqtt:host", "mqtt:h:p/t", "otel:x"],
)
def test_an_invalid_sink_is_refused(wanted: str) -> None:
    with pytest.raises(SettingsError):
        open_sink(wanted)


def test_a_file_that_cannot_be_written_is_refused(tmp_path: Path) -> None:
    with pytest.raises(OutputError):
        open_sink(f"file:{tmp_path / 'no' / 'such' / 'folder'}")


@pytest.mark.parametrize(
    ("wanted", "package", "extra"),
    [
        ("mqtt:localhost/alerts", "paho", "mqtt"),
        ("notify:mailto://a:b@c.example", "apprise", "serve"),
        ("otel:console", "opentelemetry", "otel"),
        ("rerun:x.rrd", "rerun", "rerun"),
    ],
)
def test_a_missing_extra_says_what_to_install(
    wanted: str, package: str, extra: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in [n for n in sys.modules if n.partition(".")[0] == package]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(ExtraMissingError, match=rf"visup\[{extra}\]"):
        open_sink(wanted)


def broker(listening: socket.socket, got: list[tuple[str, bytes]]) -> None:
    """As much of MQTT 3.1.1 as it takes to accept one client's messages."""
    client, _ = listening.accept()
    with client, client.makefile("rb") as stream:
        while head := stream.read(1):
            size = shift = 0
            while True:
                (byte,) = stream.read(1)
                size |= (byte & 127) << shift
                shift += 7
                if byte < 128:
                    break
            body = stream.read(size)
            if head[0] >> 4 == 1:
                client.sendall(b"\x20\x02\x00\x00")
            elif head[0] >> 4 == 3:
                (length,) = struct.unpack(">H", body[:2])
                got.append((body[2 : 2 + length].decode(), body[4 + length :]))
                client.sendall(b"\x40\x02" + body[2 + length : 4 + length])


def test_alerts_reach_an_mqtt_broker() -> None:
    pytest.importorskip("paho.mqtt", reason="the extra visup[mqtt] is not installed")
    got: list[tuple[str, bytes]] = []
    with socket.create_server(("127.0.0.1", 0)) as listening:
        thread = threading.Thread(target=broker, args=(listening, got))
        thread.start()
        sink = open_sink(f"mqtt:127.0.0.1:{listening.getsockname()[1]}/cell/alerts")
        sink.deliver({"a": 1})
        sink.deliver({"a": 2})
        sink.close()
        thread.join(5.0)
    assert got == [("cell/alerts", b'{"a":1}'), ("cell/alerts", b'{"a":2}')]


def test_steps_become_spans_and_metrics() -> None:
    pytest.importorskip("opentelemetry.sdk", reason="the extra visup[otel] is not installed")
    from opentelemetry.sdk.metrics import MeterProvider
    from opentelemetry.sdk.metrics.export import InMemoryMetricReader
    from opentelemetry.sdk.trace import TracerProvider
    from opentelemetry.sdk.trace.export import SimpleSpanProcessor
    from opentelemetry.sdk.trace.export.in_memory_span_exporter import InMemorySpanExporter

    from visup.sinks.telemetry import Telemetry

    spans, reader = InMemorySpanExporter(), InMemoryMetricReader()
    traces = TracerProvider()
    traces.add_span_processor(SimpleSpanProcessor(spans))
    sink = Telemetry("console", (traces, MeterProvider([reader])))
    sink.deliver(step(ALERT))
    inner, outer = spans.get_finished_spans()
    assert (inner.name, outer.name) == ("eye", "step")
    assert inner.parent is not None
    assert inner.parent.span_id == outer.context.span_id
    assert inner.end_time - inner.start_time == 2_000_000
    data = reader.get_metrics_data()
    named = {m.name: m for r in data.resource_metrics for s in r.scope_metrics for m in s.metrics}
    assert named["visup.steps"].data.data_points[0].value == 1
    assert named["visup.alerts"].data.data_points[0].attributes == {"kind": "worry"}
    sink.close()


def test_steps_are_written_for_rerun(tmp_path: Path) -> None:
    pytest.importorskip("rerun", reason="the extra visup[rerun] is not installed")
    path = tmp_path / "run.rrd"
    sink = open_sink(f"rerun:{path}")
    sink.deliver((step(ALERT), FRAME))
    sink.close()
    assert path.stat().st_size > 500


def test_a_run_sends_its_alerts_and_verdict_to_a_webhook(tmp_path: Path) -> None:
    clip = write_clip(tmp_path / "clip.avi", moving_disc(40), fps=10.0)
    rules = tmp_path / "own.rules"
    rules.write_text(
        'rule seen(a): warning\n    when in_view(a) > 0.2 s\n    say "{a} {is} seen."\n'
    )
    settings = WatchSettings(source=str(clip), rules=(rules,))
    with server() as (url, bodies):
        options = RunOptions(video=False, report=False, sinks=(f"webhook:{url}",))
        supervise(settings, fresh_folder(tmp_path / "run", ""), options=options)
    told = [json.loads(b) for b in bodies]
    assert [(t["record"], t.get("kind")) for t in told[:1]] == [("alert", "seen")]
    assert told[-1]["record"] == "verdict"
    assert told[-1]["verdict"] == "interrupted"


def test_sinks_cost_the_cycle_little(tmp_path: Path) -> None:
    """The bar is 10 %; what a busy machine adds is evened out by taking turns."""
    assert any(sinks_ratio(tmp_path, 240) < 1.1 for _ in range(4))


def test_a_short_soak_is_flat_and_repeats(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("visup.evaluation.runtime.soak.MIN_FRAMES", 200)
    figures = evaluate_soak(300)
    assert figures["total"]["same"] == 1
    assert figures["total"]["rss_grown_mb"] < 20
    with pytest.raises(SettingsError):
        evaluate_soak(10)


@pytest.mark.parametrize(
    ("surroundings", "name"),
    [
        ({}, "visup"),
        ({"OTEL_SERVICE_NAME": "cell-7"}, "cell-7"),
        ({"OTEL_RESOURCE_ATTRIBUTES": "service.name=cell-8"}, "cell-8"),
    ],
)
def test_telemetry_names_its_service(
    monkeypatch: pytest.MonkeyPatch, surroundings: dict[str, str], name: str
) -> None:
    pytest.importorskip("opentelemetry.sdk", reason="the extra visup[otel] is not installed")
    from visup.sinks.telemetry import service_resource

    for variable in ("OTEL_SERVICE_NAME", "OTEL_RESOURCE_ATTRIBUTES"):
        monkeypatch.delenv(variable, raising=False)
    for variable, value in surroundings.items():
        monkeypatch.setenv(variable, value)
    attributes = service_resource().attributes
    assert attributes["service.name"] == name
    assert attributes["service.version"]

"""Real processes, small ones: what they tell is heard, and they end when they are to."""

from __future__ import annotations

import os
import signal
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from visup.runs.settings import RunOptions, WatchSettings
from visup.serving.camera_child import CameraChild
from visup.serving.reports import (
    MAX_LINE_BYTES,
    CameraJob,
    CameraReport,
    ReportKind,
    ReportPipe,
    job_line,
    parse_job,
    parse_report,
    report_line,
)

JOB = CameraJob(
    WatchSettings(
        source="rtsp://guard:swordfish77@cell/1",
        tasks=("dock",),
        models=Path("/x/cell.models"),
        actors={"arm": ("rms", "crane")},
        plugin_settings={"lamp": {"contrast": 3}},
        zones=Path("zones.toml"),
        pace=5.0,
    ),
    RunOptions(video=False, sinks=("webhook:https://x/y",), keep_gb=2.0),
    Path("/store/cell/run"),
    resume=True,
)


def child(code: str) -> CameraChild:
    def command(pipe: int) -> Sequence[str]:
        return sys.executable, "-c", f"pipe = {pipe}\n{code}"

    return CameraChild(JOB, command)


def wait_for(what: Callable[[], object], seconds: float = 20.0) -> None:
    end = time.monotonic() + seconds
    while not what():
        assert time.monotonic() < end, "it did not come in time"
        time.sleep(0.01)


def test_a_job_survives_serialisation() -> None:
    assert parse_job(job_line(JOB)) == JOB


TEXTS = st.text(max_size=3 * MAX_LINE_BYTES)


@given(st.sampled_from(ReportKind), st.dictionaries(st.text(max_size=5), TEXTS, max_size=3))
def test_a_report_is_one_short_line(kind: ReportKind, data: dict[str, str]) -> None:
    data.pop("kind", None)
    line = report_line(CameraReport(kind, data))
    assert line.count(b"\n") == 1
    assert line.endswith(b"\n")
    assert len(line) <= MAX_LINE_BYTES + 1
    read = parse_report(line)
    assert read is not None
    assert read.kind is kind
    assert all(data[key].startswith(value) for key, value in read.data.items())


@given(st.binary(max_size=40))
def test_an_invalid_line_is_no_report(line: bytes) -> None:
    assert parse_report(line) is None


def test_a_full_pipe_does_not_block_the_process() -> None:
    read, write = os.pipe()
    pipe = ReportPipe(write)
    for _ in range(1000):
        pipe.send(ReportKind.NOTICE, text="x" * 1000)
    os.close(read)
    pipe.send(ReportKind.NOTICE, text="nobody listens")
    os.close(write)


def test_a_child_receives_its_job_and_its_reports_are_read() -> None:
    one = child(
        "import os, sys, json\n"
        "job = json.loads(sys.stdin.readline())\n"
        "told = {'kind': 'notice', 'text': job['settings']['source']}\n"
        "line = json.dumps(told).encode()\n"
        "os.write(pipe, line[:5]); os.write(pipe, line[5:] + b'\\nno report\\n')\n"
    )
    wait_for(lambda: one.exit_code() is not None)
    heard = one.reports()
    one.close()
    assert heard == [CameraReport(ReportKind.NOTICE, {"text": JOB.settings.source})]
    assert one.exit_code() == 0


def test_no_password_appears_in_the_process_list() -> None:
    one = child("import sys; sum(range(10**7)); sys.stdin.read()")
    words = Path(f"/proc/{one.pid}/cmdline")
    if not words.exists():
        one.kill()
        wait_for(lambda: one.exit_code() is not None)
        one.close()
        pytest.skip("this system has no /proc")
    assert b"swordfish77" not in words.read_bytes()
    assert b"swordfish77" not in Path(f"/proc/{one.pid}/environ").read_bytes()
    wait_for(lambda: 1.0 < (one.memory_mb() or 0.0) < 200.0)
    wait_for(lambda: 0.0 < (one.cpu_s() or 0.0) < 20.0)
    one.kill()
    wait_for(lambda: one.exit_code() is not None)
    one.close()
    assert one.exit_code() == -signal.SIGKILL
    assert one.memory_mb() is None


def test_termination_also_ends_the_descendants_of_a_child() -> None:
    one = child(
        "import os, signal, subprocess, sys\n"
        "other = subprocess.Popen([sys.executable, '-c', 'import time; time.sleep(100)'])\n"
        "signal.signal(signal.SIGTERM, lambda *_: os._exit(130))\n"
        'os.write(pipe, (\'{"kind": "notice", "pid": %d}\\n\' % other.pid).encode())\n'
        "signal.pause()\n"
    )
    heard: list[CameraReport] = []

    def told() -> bool:
        heard.extend(one.reports())
        return bool(heard)

    wait_for(told)
    one.terminate()
    wait_for(lambda: one.exit_code() is not None)
    one.close()
    assert one.exit_code() == 130

    def gone() -> bool:
        try:
            os.kill(heard[0].data["pid"], 0)
        except ProcessLookupError:
            return True
        # Where nobody collects orphans one stays as a zombie.
        stat = Path(f"/proc/{heard[0].data['pid']}/stat")
        return stat.exists() and stat.read_text().rpartition(")")[2].split()[0] == "Z"

    wait_for(gone)

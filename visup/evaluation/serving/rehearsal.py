"""Rehearses a service: four cameras, two of them over a faulty network, with injected faults."""

from __future__ import annotations

import json
import os
import re
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import asdict
from pathlib import Path
from statistics import median
from typing import Any

import urllib3
from urllib3.exceptions import HTTPError

from visup.agent.model.errors import SettingsError
from visup.agent.storage.atomic import write_atomically
from visup.evaluation.figures import Progress, silent, sums_of
from visup.evaluation.serving.alert_audit import AlertAuditor
from visup.evaluation.serving.costs import camera_costs
from visup.evaluation.serving.fault_injection import DiskFiller, ProcessKiller, Timetable
from visup.evaluation.serving.receiver import AlertReceiver
from visup.evaluation.serving.scene import (
    CAMERA,
    PACE,
    RULE,
    SITE,
    jpegs,
    scene,
    write_clip,
)
from visup.evaluation.serving.streams import FaultyStream

CAMERAS = ("file-1", "file-2", "stream-1", "stream-2")
MAX_START_S = 300.0
AUDIT_INTERVAL_S, SAVE_INTERVAL_S = 20.0, 60.0
"""Seconds between readings of the journals, and between savings of the figures so far. Evidence deleted for
lack of space is at least two minutes old."""

FAULT_FREE_S = 30.0
"""Time without faults at the end, seconds, in which pending alerts can be delivered."""

SINK_DOWN_S, DISK_FULL_S = 20.0, 15.0
POLL_S = 0.2
_SAMPLE = re.compile(r'^(visup_\w+)\{(?:.*,)?camera="([^"]+)"[^}]*\} (\S+)$', re.MULTILINE)


def evaluate_serving(
    minutes: float = 120.0,
    kill_every: float = 60.0,
    store: Path | None = None,
    seed: int = 0,
    so_far: Path | None = None,
    progress: Progress = silent,
) -> dict[str, Any]:
    """Rehearse a service for some time.

    Args:
        minutes: Duration.
        kill_every: Seconds between two kills.
        store: A folder for its runs, empty or new; on a small disk (at most 4 GB) that is filled at times.
        seed: Random seed of the faults.
        so_far: A file for the figures so far, written each minute.
        progress: Shows what is being done.

    Returns:
        `items` by camera: `alerts`, `lost`, `twice`, `resent`, `unrecorded`, `without_evidence`, `wrong`,
        `kills`, `slowest_s`, `frames`, `dropped`, `restarts`, `cpu` (share of a processor);
        `total`: sums, `median_s` of a return, `memory_growth` (share, from the second quarter to the last),
        `memory_mb` by the minute, `closing_s`, `exit_code`, counts of the faults, and `camera_costs`.

    Raises:
        SettingsError: The store cannot be created or is not empty.
    """
    if store is not None:
        prepare_store(store)
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        rehearsal = Rehearsal(folder, store or folder / "store", seed, stack, so_far)
        results = rehearsal.rehearse(minutes, kill_every, progress)
    progress("what a camera takes")
    return {**results, "total": {**results["total"], **camera_costs(seed)}}


def prepare_store(store: Path) -> None:
    """Create the store, or accept an empty folder.

    Raises:
        SettingsError: It is a file, is not empty, or cannot be created.
    """
    try:
        store.mkdir(parents=True, exist_ok=True)
        occupied = any(store.iterdir())
    except (FileExistsError, NotADirectoryError) as error:
        raise SettingsError(
            "the store, or a folder above it, is a file",
            where=str(store),
            expected="a folder, empty or new",
        ) from error
    except OSError as error:
        raise SettingsError(
            f"the store cannot be created or read ({error.strerror})",
            where=str(store),
            hint="choose a folder that you may write to",
        ) from error
    if occupied:
        raise SettingsError(
            "the store is not empty",
            where=str(store),
            expected="an empty or new folder, since the runs in it are counted",
            hint="choose another folder, or move its content away",
        )


class Rehearsal:
    """The service and its environment.

    Args:
        folder: Folder for the site file and the clips.
        store: Folder for the runs.
        seed: Random seed of the faults.
        stack: Closes all resources.
        so_far: A file for the figures so far.
    """

    def __init__(
        self, folder: Path, store: Path, seed: int, stack: ExitStack, so_far: Path | None = None
    ) -> None:
        self._folder, self._store, self._so_far = folder, store, so_far
        store.mkdir(exist_ok=True)
        self._receiver = AlertReceiver()
        stack.callback(self._receiver.close)
        scenes = [scene(seed + n) for n in range(len(CAMERAS))]
        for number in (0, 1):
            write_clip(folder / f"{number}.webm", scenes[number])
        self._streams = [FaultyStream(jpegs(s), seed + n) for n, s in enumerate(scenes[2:])]
        for stream in self._streams:
            stack.callback(stream.close)
        self._disk_filler = DiskFiller(store)
        stack.callback(self._disk_filler.empty)
        self._killer = ProcessKiller(store, CAMERAS, seed)
        self._auditors = {name: AlertAuditor(store / name) for name in CAMERAS}
        self._monitoring_port = _free_port()
        self._write_site()
        self._figures: dict[str, dict[str, float]] = {}
        self._memory: list[tuple[float, float]] = []
        self._watched_s = 1.0
        self._fault_counts = {"reloads": 0, "sink_down": 0}
        self._pending_ends: list[tuple[float, Any]] = []

    def rehearse(self, minutes: float, kill_every: float, progress: Progress) -> dict[str, Any]:
        """Run from the first frame to the account."""
        with self._service() as process:
            self._wait_until_ready(process)
            begin = time.monotonic()
            end = begin + 60.0 * minutes
            table, measurements = self._timetable(process, kill_every), self._measurements(begin)
            while (now := time.monotonic()) < end and process.poll() is None:
                self._read_metrics(process.pid)
                if now < end - FAULT_FREE_S:
                    table.tick(now)
                self._end_due_faults(now)
                measurements.tick(now)
                left = (end - now) / 60.0
                progress(f"{left:.1f} minutes left, {len(self._killer.kills)} kills")
                time.sleep(POLL_S)
            stop_requested = time.monotonic()
            self._watched_s = stop_requested - begin
            process.send_signal(signal.SIGTERM)
            code = process.wait(60)
            closing_s = time.monotonic() - stop_requested
            self._read_stores()
            return self._save(self._results(closing_s, code))

    def _write_site(self) -> None:
        loops = [f"loop:{self._folder / f'{n}.webm'}" for n in (0, 1)]
        sources = [*loops, *(s.url for s in self._streams)]
        cameras = (
            CAMERA.format(name=name, source=source, pace=PACE)
            for name, source in zip(CAMERAS, sources, strict=True)
        )
        head = SITE.format(
            store=self._store,
            port=self._receiver.port,
            monitoring=self._monitoring_port,
            hours=2.0 / 60.0,
            free_gb=0.05 if self._disk_filler.possible else 0.5,
        )
        (self._folder / "own.rules").write_text(RULE)
        (self._folder / "site.toml").write_text(head + "".join(cameras))

    @contextmanager
    def _service(self) -> Iterator[subprocess.Popen[bytes]]:
        command = [sys.executable, "-m", "visup.cli", "serve", str(self._folder / "site.toml")]
        with (self._folder / "log").open("ab") as log:
            process = subprocess.Popen([*command, "--json"], stderr=log)
        try:
            yield process
        finally:
            process.kill()
            process.wait()

    def _wait_until_ready(self, process: subprocess.Popen[bytes]) -> None:
        deadline = time.monotonic() + MAX_START_S
        while time.monotonic() < deadline and process.poll() is None:
            self._read_metrics(process.pid)
            if all(self._figures.get(n, {}).get("visup_frames_seen_total") for n in CAMERAS):
                return
            time.sleep(POLL_S)
        raise SettingsError(
            "the service did not begin", where=(self._folder / "log").read_text()[-2000:]
        )

    def _timetable(self, process: subprocess.Popen[bytes], kill_every: float) -> Timetable:
        def reload() -> None:
            self._fault_counts["reloads"] += 1
            process.send_signal(signal.SIGHUP)

        def sink_down() -> None:
            self._fault_counts["sink_down"] += 1
            self._receiver.down = True
            self._pending_ends.append((time.monotonic() + SINK_DOWN_S, self._sink_up))

        def full() -> None:
            if self._disk_filler.possible:
                self._disk_filler.fill()
                self._pending_ends.append((time.monotonic() + DISK_FULL_S, self._disk_filler.empty))

        def kill() -> None:
            self._killer.kill_one(self._metric_by_camera("visup_restarts_total"))

        return Timetable(((kill_every, kill), (100.0, reload), (75.0, sink_down), (130.0, full)))

    def _measurements(self, begin: float) -> Timetable:
        """The timetable of measurements."""

        def write() -> None:
            self._watched_s = time.monotonic() - begin
            self._save(self._results(0.0, None))

        return Timetable(((AUDIT_INTERVAL_S, self._read_stores), (SAVE_INTERVAL_S, write)))

    def _save(self, results: dict[str, Any]) -> dict[str, Any]:
        """Save the figures so far, so that hours of work are not lost by a later fault."""
        if self._so_far:
            write_atomically(self._so_far, json.dumps(results, indent=1).encode())
        return results

    def _read_stores(self) -> None:
        for auditor in self._auditors.values():
            auditor.read_store()

    def _sink_up(self) -> None:
        self._receiver.down = False

    def _end_due_faults(self, now: float) -> None:
        for pending in [e for e in self._pending_ends if e[0] <= now]:
            self._pending_ends.remove(pending)
            pending[1]()

    def _metric_by_camera(self, metric: str) -> dict[str, float]:
        return {name: metrics.get(metric, 0.0) for name, metrics in self._figures.items()}

    def _read_metrics(self, pid: int) -> None:
        """Read the metrics of the service."""
        with suppress(HTTPError):
            url = f"http://127.0.0.1:{self._monitoring_port}/metrics"
            page = urllib3.request("GET", url, timeout=5.0, retries=False).data.decode()
            for metric, camera, value in _SAMPLE.findall(page):
                self._figures.setdefault(camera, {})[metric] = float(value)
            frames = self._metric_by_camera("visup_frames_seen_total")
            self._killer.note_recoveries(self._metric_by_camera("visup_restarts_total"), frames)
            cameras = [f.get("visup_memory_bytes", 0.0) for f in self._figures.values()]
            if len(cameras) == len(CAMERAS) and all(cameras):
                used = sum(cameras) / 2**20 + _resident_mb(pid)
                self._memory.append((time.monotonic(), used))

    def _results(self, closing_s: float, code: int | None) -> dict[str, Any]:
        items = {name: self._camera_results(name) for name in CAMERAS}
        keys = (
            *("alerts", "lost", "twice", "resent", "unrecorded", "without_evidence"),
            *("kills", "restarts", "frames", "dropped"),
        )
        outages = [k.back_s for k in self._killer.kills if k.back_s is not None]
        total = {
            **sums_of(list(items.values()), keys),
            "not_back": sum(k.back_s is None for k in self._killer.kills),
            "median_s": median(outages) if outages else 0.0,
            "slowest_s": max(outages, default=0.0),
            "memory_growth": _growth(self._memory),
            "memory_mb": _by_minute(self._memory),
            "watched_s": self._watched_s,
            "closing_s": closing_s,
            "exit_code": code,
            "troubles": sum(s.faults for s in self._streams),
            "disk_full": self._disk_filler.filled,
            "refused": self._receiver.refused,
            **self._fault_counts,
        }
        return {"items": items, "total": total}

    def _camera_results(self, name: str) -> dict[str, Any]:
        figures = self._figures.get(name, {})
        own = [k for k in self._killer.kills if k.camera == name]
        return {
            **asdict(self._auditors[name].audit(list(self._receiver.records))),
            "kills": len(own),
            "slowest_s": max((k.back_s or 0.0 for k in own), default=0.0),
            "restarts": figures.get("visup_restarts_total", 0.0),
            "frames": figures.get("visup_frames_seen_total", 0.0),
            "dropped": figures.get("visup_frames_dropped_total", 0.0),
            "cpu": figures.get("visup_cpu_seconds_total", 0.0) / self._watched_s,
        }


def failed(figures: Mapping[str, Any]) -> bool:
    """Whether an alert was lost or duplicated, or a camera did not recover in time."""
    total = figures["total"]
    late = total["slowest_s"] > 10.0 or total["not_back"]
    return bool(total["lost"] or total["twice"] > total["resent"] or late)


def _growth(memory: Sequence[tuple[float, float]]) -> float:
    """Relative growth from the second quarter to the last."""
    used = [mb for _, mb in memory]
    quarter = len(used) // 4
    if not quarter:
        return 0.0
    return median(used[-quarter:]) / median(used[quarter : 2 * quarter]) - 1.0


def _by_minute(memory: Sequence[tuple[float, float]]) -> list[float]:
    """Medians per minute of the memory of all processes together, megabytes."""
    minutes: dict[int, list[float]] = {}
    for at, mb in memory:
        minutes.setdefault(int((at - memory[0][0]) / 60.0), []).append(mb)
    return [round(median(used), 1) for _, used in sorted(minutes.items())]


def _resident_mb(pid: int) -> float:
    pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20


def _free_port() -> int:
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return int(one.getsockname()[1])

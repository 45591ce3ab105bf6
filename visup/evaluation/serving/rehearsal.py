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
from visup.evaluation.serving.account import Ledger
from visup.evaluation.serving.costs import camera_costs
from visup.evaluation.serving.night import Balloon, Killer, Timetable
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
from visup.evaluation.serving.streams import TroubledStream

NAMES = ("file-1", "file-2", "stream-1", "stream-2")
START_S = 300.0
LEDGER_S, SO_FAR_S = 20.0, 60.0
"""Seconds between readings of the journals, and between savings of the figures so far. Evidence deleted for
lack of space is at least two minutes old."""

CALM_S = 30.0
"""Time without faults at the end, seconds, in which pending alerts can be delivered."""

DOWN_S, FULL_S = 20.0, 15.0
LOOK_S = 0.2
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
        stage = Rehearsal(folder, store or folder / "store", seed, stack, so_far)
        told = stage.rehearse(minutes, kill_every, progress)
    progress("what a camera takes")
    return {**told, "total": {**told["total"], **camera_costs(seed)}}


def prepare_store(store: Path) -> None:
    """Create the store, or accept an empty folder.

    Raises:
        SettingsError: It is a file, is not empty, or cannot be created.
    """
    try:
        store.mkdir(parents=True, exist_ok=True)
        occupied = any(store.iterdir())
    except (FileExistsError, NotADirectoryError) as fault:
        raise SettingsError(
            "the store, or a folder above it, is a file",
            where=str(store),
            expected="a folder, empty or new",
        ) from fault
    except OSError as fault:
        raise SettingsError(
            f"the store cannot be created or read ({fault.strerror})",
            where=str(store),
            hint="choose a folder that you may write to",
        ) from fault
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
        scenes = [scene(seed + n) for n in range(len(NAMES))]
        for number in (0, 1):
            write_clip(folder / f"{number}.webm", scenes[number])
        self._streams = [TroubledStream(jpegs(s), seed + n) for n, s in enumerate(scenes[2:])]
        for stream in self._streams:
            stack.callback(stream.close)
        self._balloon = Balloon(store)
        stack.callback(self._balloon.empty)
        self._killer = Killer(store, NAMES, seed)
        self._ledgers = {name: Ledger(store / name) for name in NAMES}
        self._monitoring = _free_port()
        self._write_site()
        self._figures: dict[str, dict[str, float]] = {}
        self._memory: list[tuple[float, float]] = []
        self._watched_s = 1.0
        self._wrongs = {"reloads": 0, "sink_down": 0}
        self._ends: list[tuple[float, Any]] = []

    def rehearse(self, minutes: float, kill_every: float, progress: Progress) -> dict[str, Any]:
        """Run from the first frame to the account."""
        with self._service() as process:
            self._wait_until_ready(process)
            begin = time.monotonic()
            end = begin + 60.0 * minutes
            table, books = self._timetable(process, kill_every), self._books(begin)
            while (now := time.monotonic()) < end and process.poll() is None:
                self._look(process.pid)
                if now < end - CALM_S:
                    table.tick(now)
                self._end_what_is_due(now)
                books.tick(now)
                left = (end - now) / 60.0
                progress(f"{left:.1f} minutes left, {len(self._killer.kills)} kills")
                time.sleep(LOOK_S)
            asked = time.monotonic()
            self._watched_s = asked - begin
            process.send_signal(signal.SIGTERM)
            code = process.wait(60)
            closing_s = time.monotonic() - asked
            self._look_into_journals()
            return self._keep(self._told(closing_s, code))

    def _write_site(self) -> None:
        loops = [f"loop:{self._folder / f'{n}.webm'}" for n in (0, 1)]
        sources = [*loops, *(s.url for s in self._streams)]
        cameras = (
            CAMERA.format(name=name, source=source, pace=PACE)
            for name, source in zip(NAMES, sources, strict=True)
        )
        head = SITE.format(
            store=self._store,
            port=self._receiver.port,
            monitoring=self._monitoring,
            hours=2.0 / 60.0,
            free_gb=0.05 if self._balloon.possible else 0.5,
        )
        (self._folder / "own.rules").write_text(RULE)
        (self._folder / "site.toml").write_text(head + "".join(cameras))

    @contextmanager
    def _service(self) -> Iterator[subprocess.Popen[bytes]]:
        words = [sys.executable, "-m", "visup.cli", "serve", str(self._folder / "site.toml")]
        with (self._folder / "log").open("ab") as log:
            process = subprocess.Popen([*words, "--json"], stderr=log)
        try:
            yield process
        finally:
            process.kill()
            process.wait()

    def _wait_until_ready(self, process: subprocess.Popen[bytes]) -> None:
        until = time.monotonic() + START_S
        while time.monotonic() < until and process.poll() is None:
            self._look(process.pid)
            if all(self._figures.get(n, {}).get("visup_frames_seen_total") for n in NAMES):
                return
            time.sleep(LOOK_S)
        raise SettingsError(
            "the service did not begin", where=(self._folder / "log").read_text()[-2000:]
        )

    def _timetable(self, process: subprocess.Popen[bytes], kill_every: float) -> Timetable:
        def reload() -> None:
            self._wrongs["reloads"] += 1
            process.send_signal(signal.SIGHUP)

        def sink_down() -> None:
            self._wrongs["sink_down"] += 1
            self._receiver.down = True
            self._ends.append((time.monotonic() + DOWN_S, self._sink_up))

        def full() -> None:
            if self._balloon.possible:
                self._balloon.fill()
                self._ends.append((time.monotonic() + FULL_S, self._balloon.empty))

        def kill() -> None:
            self._killer.strike(self._of_each("visup_restarts_total"))

        return Timetable(((kill_every, kill), (100.0, reload), (75.0, sink_down), (130.0, full)))

    def _books(self, begin: float) -> Timetable:
        """The timetable of measurements."""

        def write() -> None:
            self._watched_s = time.monotonic() - begin
            self._keep(self._told(0.0, None))

        return Timetable(((LEDGER_S, self._look_into_journals), (SO_FAR_S, write)))

    def _keep(self, told: dict[str, Any]) -> dict[str, Any]:
        """Save the figures so far, so that hours of work are not lost by a later fault."""
        if self._so_far:
            write_atomically(self._so_far, json.dumps(told, indent=1).encode())
        return told

    def _look_into_journals(self) -> None:
        for ledger in self._ledgers.values():
            ledger.look()

    def _sink_up(self) -> None:
        self._receiver.down = False

    def _end_what_is_due(self, now: float) -> None:
        for due in [e for e in self._ends if e[0] <= now]:
            self._ends.remove(due)
            due[1]()

    def _of_each(self, figure: str) -> dict[str, float]:
        return {name: told.get(figure, 0.0) for name, told in self._figures.items()}

    def _look(self, pid: int) -> None:
        """Read the metrics of the service."""
        with suppress(HTTPError):
            at = f"http://127.0.0.1:{self._monitoring}/metrics"
            page = urllib3.request("GET", at, timeout=5.0, retries=False).data.decode()
            for figure, camera, value in _SAMPLE.findall(page):
                self._figures.setdefault(camera, {})[figure] = float(value)
            frames = self._of_each("visup_frames_seen_total")
            self._killer.look(self._of_each("visup_restarts_total"), frames)
            cameras = [f.get("visup_memory_bytes", 0.0) for f in self._figures.values()]
            if len(cameras) == len(NAMES) and all(cameras):
                used = sum(cameras) / 2**20 + _resident_mb(pid)
                self._memory.append((time.monotonic(), used))

    def _told(self, closing_s: float, code: int | None) -> dict[str, Any]:
        items = {name: self._of_camera(name) for name in NAMES}
        keys = (
            *("alerts", "lost", "twice", "resent", "unrecorded", "without_evidence"),
            *("kills", "restarts", "frames", "dropped"),
        )
        backs = [k.back_s for k in self._killer.kills if k.back_s is not None]
        total = {
            **sums_of(list(items.values()), keys),
            "not_back": sum(k.back_s is None for k in self._killer.kills),
            "median_s": median(backs) if backs else 0.0,
            "slowest_s": max(backs, default=0.0),
            "memory_growth": _growth(self._memory),
            "memory_mb": _by_minute(self._memory),
            "watched_s": self._watched_s,
            "closing_s": closing_s,
            "exit_code": code,
            "troubles": sum(s.troubles for s in self._streams),
            "disk_full": self._balloon.filled,
            "refused": self._receiver.refused,
            **self._wrongs,
        }
        return {"items": items, "total": total}

    def _of_camera(self, name: str) -> dict[str, Any]:
        figures = self._figures.get(name, {})
        own = [k for k in self._killer.kills if k.camera == name]
        return {
            **asdict(self._ledgers[name].account(list(self._receiver.records))),
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

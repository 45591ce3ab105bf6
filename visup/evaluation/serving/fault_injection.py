"""Injects faults by a timetable: kills, reloads, an unavailable sink, a full disk."""

from __future__ import annotations

import os
import random
import shutil
import signal
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

MAX_DISK_BYTES = 4e9
"""Largest disk that may be filled, bytes."""

BLOCK = b"\0" * 2**20


def pid_of(store: Path, camera: str) -> int:
    """Id of the process that has a journal of a camera open, or 0 (Linux)."""
    for folder in Path("/proc").glob("[0-9]*/fd"):
        with suppress(OSError):
            if any(f"{store}/{camera}/2" in str(fd.readlink()) for fd in folder.iterdir()):
                return int(folder.parent.name)
    return 0


@dataclass(slots=True)
class Kill:
    """A process that was killed.

    Attributes:
        camera: The camera.
        time: Time of the kill, seconds.
        restarts: Restarts of the camera before.
        frames: Reported frames when its process had been restarted; None before.
        back_s: Seconds until the next reported frame; None before.
    """

    camera: str
    time: float
    restarts: float
    frames: float | None = None
    back_s: float | None = None


@dataclass(slots=True)
class Timetable:
    """Periodic actions.

    Attributes:
        every: Interval in seconds, and action.
    """

    every: Sequence[tuple[float, Callable[[], None]]]
    _due: list[float] = field(default_factory=list)

    def tick(self, now: float) -> None:
        """Do what is due."""
        if not self._due:
            self._due = [now + every for every, _ in self.every]
        for number, (every, action) in enumerate(self.every):
            if now >= self._due[number]:
                self._due[number] = now + every
                action()


class ProcessKiller:
    """Kills camera processes at random, and measures the outages.

    Args:
        store: Store of the service.
        cameras: Names of the cameras.
        seed: Random seed.

    Attributes:
        kills: The kills so far.
    """

    def __init__(self, store: Path, cameras: Sequence[str], seed: int) -> None:
        self.kills: list[Kill] = []
        self._store, self._cameras = store, cameras
        self._rng = random.Random(seed)  # dice, not secrets

    def kill_one(self, restarts: Mapping[str, float]) -> None:
        """Kill one, given the restarts of each."""
        camera = self._rng.choice(self._cameras)
        pid = pid_of(self._store, camera)
        if pid:
            os.kill(pid, signal.SIGKILL)
            self.kills.append(Kill(camera, time.monotonic(), restarts.get(camera, 0.0)))

    def note_recoveries(self, restarts: Mapping[str, float], frames: Mapping[str, float]) -> None:
        """Detect recovered cameras: those with a new frame since the restart."""
        for kill in self.kills:
            frame_count = frames.get(kill.camera, 0.0)
            if kill.back_s is not None or restarts.get(kill.camera, 0.0) <= kill.restarts:
                continue
            if kill.frames is None:
                kill.frames = frame_count
            elif frame_count > kill.frames:
                kill.back_s = time.monotonic() - kill.time


class DiskFiller:
    """Fills a small disk temporarily.

    Args:
        folder: A folder on the disk.

    Attributes:
        filled: Number of times.
    """

    def __init__(self, folder: Path) -> None:
        self.filled = 0
        self._file = folder / "balloon"

    @property
    def possible(self) -> bool:
        """Whether the disk is small enough to be filled."""
        return shutil.disk_usage(self._file.parent).total <= MAX_DISK_BYTES

    def fill(self) -> None:
        """Fill the disk."""
        self.filled += 1
        with suppress(OSError), self._file.open("wb", buffering=0) as file:
            while file.write(BLOCK):
                pass

    def empty(self) -> None:
        """Free the space."""
        self._file.unlink(missing_ok=True)

"""What goes wrong in a night, and when: kills, a file read again, a sink that is down, a full disk."""

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

SMALL_DISK = 4e9
"""Bytes; only a disk that is no larger is filled."""

PIECE = b"\0" * 2**20


def pid_of(store: Path, camera: str) -> int:
    """The process that has a journal of a camera open; 0 when there is none (Linux)."""
    for folder in Path("/proc").glob("[0-9]*/fd"):
        with suppress(OSError):
            if any(f"{store}/{camera}/2" in str(fd.readlink()) for fd in folder.iterdir()):
                return int(folder.parent.name)
    return 0


@dataclass(slots=True)
class Kill:
    """A process that was killed.

    Attributes:
        camera: Whose.
        at: When, seconds of the clock.
        restarts: Of the camera until then.
        frames: That were told of when its process had been begun again; None before.
        back_s: How long until the next frame was told of; None as long as none is.
    """

    camera: str
    at: float
    restarts: float
    frames: float | None = None
    back_s: float | None = None


@dataclass(slots=True)
class Timetable:
    """Things that are done again and again.

    Attributes:
        every: Seconds between two of each, and what is done.
    """

    every: Sequence[tuple[float, Callable[[], None]]]
    _due: list[float] = field(default_factory=list)

    def turn(self, now: float) -> None:
        """Do what is due."""
        if not self._due:
            self._due = [now + every for every, _ in self.every]
        for number, (every, act) in enumerate(self.every):
            if now >= self._due[number]:
                self._due[number] = now + every
                act()


class Killer:
    """Kills a camera's process at random, and learns how long it is away.

    Args:
        store: Of the service.
        cameras: Names.
        seed: Of whom it meets.

    Attributes:
        kills: So far.
    """

    def __init__(self, store: Path, cameras: Sequence[str], seed: int) -> None:
        self.kills: list[Kill] = []
        self._store, self._cameras = store, cameras
        self._rng = random.Random(seed)  # dice, not secrets

    def strike(self, restarts: Mapping[str, float]) -> None:
        """Kill one, given how often each was begun again."""
        camera = self._rng.choice(self._cameras)
        pid = pid_of(self._store, camera)
        if pid:
            os.kill(pid, signal.SIGKILL)
            self.kills.append(Kill(camera, time.monotonic(), restarts.get(camera, 0.0)))

    def look(self, restarts: Mapping[str, float], frames: Mapping[str, float]) -> None:
        """Learn who is back: a frame more than when its process was begun again."""
        for kill in self.kills:
            now = frames.get(kill.camera, 0.0)
            if kill.back_s is not None or restarts.get(kill.camera, 0.0) <= kill.restarts:
                continue
            if kill.frames is None:
                kill.frames = now
            elif now > kill.frames:
                kill.back_s = time.monotonic() - kill.at


class Balloon:
    """Takes all room of a small disk, for a while.

    Args:
        folder: On the disk.

    Attributes:
        filled: How often.
    """

    def __init__(self, folder: Path) -> None:
        self.filled = 0
        self._file = folder / "balloon"

    @property
    def possible(self) -> bool:
        """Whether the disk is small enough to be filled."""
        return shutil.disk_usage(self._file.parent).total <= SMALL_DISK

    def fill(self) -> None:
        """Take all room."""
        self.filled += 1
        with suppress(OSError), self._file.open("wb", buffering=0) as file:
            while file.write(PIECE):
                pass

    def empty(self) -> None:
        """Give it back."""
        self._file.unlink(missing_ok=True)

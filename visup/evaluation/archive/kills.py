"""Checks that a lake is filled correctly while workers and the whole command are killed."""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Mapping
from pathlib import Path
from random import Random
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.agent.model.errors import OutputError
from visup.archive.extra import imported
from visup.archive.lake import Lake
from visup.archive.schema import TABLES
from visup.evaluation.figures import Progress

FRAMES = 16
SIZE = (160, 120)
DISC_PX = 31
DISC_SPEED = 5
"""Motion of a disc, pixels per frame."""
WORKERS = 2
MAX_FILL_S = 3600.0
"""Seconds after which filling a lake is given up."""
GreyImage = NDArray[np.uint8]
KILL_TARGETS = ("workers", "starters", "heads")
"""What is killed: workers, their parent processes, or the command with all of them."""


def write_clips(folder: Path, count: int, seed: int = 0) -> Path:
    """Write short clips, each different: two textured discs pass each other before a textured background.

    Args:
        folder: Folder for the clips; created if missing.
        count: Number of clips.
        seed: Random seed.

    Returns:
        The folder.
    """
    folder.mkdir(parents=True, exist_ok=True)
    for number in range(count):
        rng = np.random.default_rng((seed, number))
        background = _texture(rng, (0, 120), SIZE[::-1])
        discs = [_texture(rng, (120, 255), (DISC_PX, DISC_PX)) for _ in range(2)]
        codec, path = cv2.VideoWriter.fourcc(*"MJPG"), folder / f"clip-{number:04}.avi"
        writer = cv2.VideoWriter(str(path), codec, 25.0, SIZE)
        for index in range(FRAMES):
            image, x = background.copy(), 8 + DISC_SPEED * index
            image[20 : 20 + DISC_PX, x : x + DISC_PX] = discs[0]
            image[70 : 70 + DISC_PX, SIZE[0] - x - DISC_PX : SIZE[0] - x] = discs[1]
            writer.write(np.repeat(image[:, :, None], 3, axis=2))
        writer.release()
    return folder


def _texture(
    rng: np.random.Generator, values: tuple[int, int], shape: tuple[int, int]
) -> GreyImage:
    noise = rng.integers(*values, shape).astype(np.uint8)
    return cv2.GaussianBlur(noise, (0, 0), 1.5).astype(np.uint8)


def compare_killed(
    folder: Path, clips: int, kills: int, heads: int, seed: int, progress: Progress
) -> dict[str, Any]:
    """Fill a lake undisturbed, and one while processes are killed; compare them row for row.

    Kills are spread over about the time of filling the lake undisturbed. If it is full before all are done,
    further lakes are filled and compared, too.

    Args:
        folder: A folder for all lakes.
        clips: Number of short clips.
        kills: Number of kills of workers.
        heads: Number of kills of the command with scheduler and workers; also of the parents of workers.
        seed: Random seed of clips and kills.
        progress: Shows what is being done.

    Returns:
        `clips`; killed `workers`, `starters` and `heads`; `calls` of the command, filled `lakes`, compared
        `rows`, and `different` rows.
    """
    clip_folder = write_clips(folder / "clips", clips, seed)
    progress("undisturbed")
    begin = time.monotonic()
    _wait(_start_filling(clip_folder, folder / "whole"))
    undisturbed_s, begin = time.monotonic() - begin, time.monotonic()
    killer = RandomKills(
        dict(zip(KILL_TARGETS, (kills, heads, heads), strict=True)),
        2.0 * undisturbed_s / (kills + 2 * heads),
        Random(seed),
    )
    calls, lakes = 0, [folder / "killed"]
    while (killer.left or len(_runs(lakes[-1])) < clips) and time.monotonic() - begin < MAX_FILL_S:
        if len(_runs(lakes[-1])) == clips:
            lakes.append(folder / f"killed-{len(lakes)}")
        progress(f"{len(_runs(lakes[-1]))} of {clips} runs, {sum(killer.left.values())} kills left")
        calls += 1
        killer.kill_during(_start_filling(clip_folder, lakes[-1]))
    rows = [_differences(folder / "whole", lake) for lake in lakes]
    return {
        "clips": clips,
        **killer.done,
        "calls": calls,
        "lakes": len(lakes),
        "rows": sum(counts[0] for counts in rows),
        "different": sum(counts[1] for counts in rows),
    }


def _start_filling(clip_folder: Path, lake: Path) -> subprocess.Popen[bytes]:
    arguments = ["archive", "run", str(clip_folder), "--into", str(lake), "--workers", str(WORKERS)]
    return subprocess.Popen(
        [sys.executable, "-m", "visup.cli", *arguments, "--retry"],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )


def _wait(process: subprocess.Popen[bytes]) -> None:
    if process.wait(MAX_FILL_S) not in (0, 1):
        raise OutputError(f"`visup archive run` ended with {process.returncode}")


class RandomKills:
    """Kills processes of the command at random moments.

    Args:
        wanted: Number of kills for each of `KILL_TARGETS`.
        pause_s: The longest time between two kills.
        rng: Random generator.
    """

    def __init__(self, counts: Mapping[str, int], pause_s: float, rng: Random) -> None:
        self._counts, self._pause_s, self._rng = counts, pause_s, rng
        self.done = dict.fromkeys(counts, 0)

    @property
    def left(self) -> dict[str, int]:
        """Remaining kills by kind."""
        left = {kind: self._counts[kind] - self.done[kind] for kind in self._counts}
        return {kind: count for kind, count in left.items() if count > 0}

    def kill_during(self, process: subprocess.Popen[bytes]) -> None:
        """Kill processes of one call of the command, perhaps the command itself, until it has ended."""
        while process.poll() is None:
            time.sleep(self._rng.uniform(0.0, self._pause_s))
            if not (left := self.left):
                process.wait()
                return
            kind = self._rng.choices(list(left), list(left.values()))[0]
            if victims := self._victims(process.pid, kind):
                self.done[kind] += 1
                _kill(victims)
        process.wait()

    def _victims(self, command: int, kind: str) -> list[int]:
        """The processes to kill at once: one worker, one parent of workers, or all."""
        starters, descendants = _process_tree(command)
        if kind == "heads":
            return [command, *descendants]
        candidates = starters if kind == "starters" else sorted({*descendants} - {*starters})
        return [self._rng.choice(candidates)] if candidates else []


def _process_tree(process: int) -> tuple[list[int], list[int]]:
    """The children of a process, and all its descendants."""
    psutil = imported("psutil")
    try:
        command = psutil.Process(process)
        descendants = [
            [p.pid for p in command.children(recursive=recursive)] for recursive in (False, True)
        ]
    except psutil.Error:
        return [], []
    return descendants[0], descendants[1]


def _kill(processes: list[int]) -> None:
    psutil = imported("psutil")
    for process in processes:
        try:
            psutil.Process(process).kill()
        except psutil.Error:
            continue  # already ended


def _runs(lake: Path) -> list[str]:
    return Lake(lake).runs()


def _differences(one: Path, other: Path) -> tuple[int, int]:
    """Number of compared rows, and of different ones."""
    rows = different = 0
    for name in TABLES:
        first, second = list(Lake(one).rows(name)), list(Lake(other).rows(name))
        rows += len(first)
        different += abs(len(first) - len(second))
        different += sum(a != b for a, b in zip(first, second, strict=False))
    return rows, different

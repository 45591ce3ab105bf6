"""A lake filled while workers, and the command with its scheduler, are killed: the same in the end."""

from __future__ import annotations

import subprocess
import sys
import time
from pathlib import Path
from random import Random
from typing import Any

import cv2
import numpy as np

from visup.agent.model.errors import OutputError
from visup.archive.extra import imported
from visup.archive.lake import Lake
from visup.archive.schema import TABLES
from visup.evaluation.figures import Progress

FRAMES = 50
SIZE = (160, 120)
WORKERS = 2
SLOWEST_S = 1800.0


def write_clips(folder: Path, count: int) -> Path:
    """Short clips, no two alike: a textured disc crosses a textured ground."""
    folder.mkdir(parents=True, exist_ok=True)
    for number in range(count):
        rng = np.random.default_rng(number)
        ground = cv2.GaussianBlur(rng.integers(0, 120, SIZE[::-1]).astype(np.uint8), (0, 0), 1.5)
        disc = cv2.GaussianBlur(rng.integers(120, 255, (31, 31)).astype(np.uint8), (0, 0), 1.5)
        kind, path = cv2.VideoWriter.fourcc(*"MJPG"), folder / f"clip-{number:04}.avi"
        writer = cv2.VideoWriter(str(path), kind, 25.0, SIZE)
        for index in range(FRAMES):
            image = ground.copy()
            image[40:71, 8 + 2 * index : 39 + 2 * index] = disc
            writer.write(np.repeat(image[:, :, None], 3, axis=2))
        writer.release()
    return folder


def compare_killed(
    place: Path, clips: int, kills: int, heads: int, seed: int, progress: Progress
) -> dict[str, Any]:
    """Fill a lake undisturbed, and one while processes are killed; compare them row for row.

    Args:
        place: A folder for both.
        clips: How many short clips.
        kills: How many times a worker is killed.
        heads: How many times the command is, with its scheduler and all its workers.
        seed: Of when, and whom.
        progress: Shows what is being done.

    Returns:
        `clips`, `kills` and `heads` that were done, `calls` of the command, `runs` in the lake, `rows`
        compared, and `different` rows.
    """
    footage, rng = write_clips(place / "clips", clips), Random(seed)
    progress("undisturbed")
    _wait(_begun(footage, place / "whole"))
    done = {"kills": 0, "heads": 0, "calls": 0}
    begin = time.monotonic()
    lake = place / "killed"
    while len(_runs(lake)) < clips or done["kills"] < kills or done["heads"] < heads:
        if time.monotonic() - begin > SLOWEST_S:
            break
        if len(_runs(lake)) == clips:  # all is there before all kills are done: one more lake
            lake = lake.with_name(f"{lake.name}-more")
        progress(f"{len(_runs(lake))} of {clips} runs, {done['kills']} workers killed")
        _disturbed(footage, lake, (kills, heads), done, rng)
    lakes = sorted(place.glob("killed*"))
    rows = [_differences(place / "whole", each) for each in lakes]
    return {
        "clips": clips,
        **done,
        "lakes": len(lakes),
        "rows": sum(r[0] for r in rows),
        "different": sum(r[1] for r in rows),
    }


def _begun(footage: Path, lake: Path) -> subprocess.Popen[bytes]:
    words = ["archive", "run", str(footage), "--into", str(lake), "--workers", str(WORKERS)]
    return subprocess.Popen(
        [sys.executable, "-m", "visup.cli", *words, "--retry"],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )


def _wait(process: subprocess.Popen[bytes]) -> None:
    if process.wait(SLOWEST_S) not in (0, 1):
        raise OutputError(f"`visup archive run` ended with {process.returncode}")


def _disturbed(
    footage: Path, lake: Path, wanted: tuple[int, int], done: dict[str, int], rng: Random
) -> None:
    """One call of the command, during which workers are killed, and perhaps it is itself."""
    process = _begun(footage, lake)
    done["calls"] += 1
    while process.poll() is None:
        time.sleep(rng.uniform(0.2, 2.5))
        family = _family(process.pid)
        if done["heads"] < wanted[1] and rng.random() < 0.25:
            done["heads"] += 1
            _kill([process.pid, *family])
        elif family and done["kills"] < wanted[0]:
            done["kills"] += 1
            _kill([rng.choice(family)])
    process.wait()


def _family(process: int) -> list[int]:
    """The processes that one has started, those of these among them."""
    psutil = imported("psutil")
    try:
        return [child.pid for child in psutil.Process(process).children(recursive=True)]
    except psutil.Error:
        return []


def _kill(processes: list[int]) -> None:
    psutil = imported("psutil")
    for process in processes:
        try:
            psutil.Process(process).kill()
        except psutil.Error:
            continue  # it has ended by itself


def _runs(lake: Path) -> list[str]:
    return Lake(lake).runs()


def _differences(one: Path, other: Path) -> tuple[int, int]:
    """How many rows there are, and how many differ."""
    rows = different = 0
    for name in TABLES:
        first, second = list(Lake(one).rows(name)), list(Lake(other).rows(name))
        rows += len(first)
        different += abs(len(first) - len(second))
        different += sum(a != b for a, b in zip(first, second, strict=False))
    return rows, different

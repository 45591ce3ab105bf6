"""What two workers bring over one, and what a lake costs over plain watching."""

from __future__ import annotations

import shutil
import statistics
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import cv2

from visup.archive.filling.clips import Clip
from visup.archive.filling.filling import fill
from visup.archive.filling.plan import make_plan
from visup.archive.filling.pool import Pool, open_pool
from visup.archive.filling.pool_settings import PoolSettings
from visup.archive.filling.watching import ClipOutcome, watch_into
from visup.archive.lake import Lake
from visup.evaluation.figures import Progress
from visup.runs.settings import WatchSettings


def measure_throughput(
    place: Path, missions: Sequence[Path], frames: int, rounds: int, progress: Progress
) -> dict[str, Any]:
    """Watch the beginnings of missions plainly, into a lake, by one worker, and by two, in turn.

    Args:
        place: A folder for all of it.
        missions: Folders with `video.mp4`.
        frames: Of each that are watched.
        rounds: How often; the ratios are medians of those of the rounds.
        progress: Shows what is being done.

    Returns:
        `video_s` of a round; `plain_s`, `lake_s`, `one_s` and `two_s`, medians; `speedup` of two workers over
        one, and `overhead` of a lake over plain watching on one process, a share.
    """
    clips = [_beginning(m / "video.mp4", place / f"{m.name}.avi", frames) for m in missions]
    taken: dict[str, list[float]] = {name: [] for name in ("plain", "lake", "one", "two")}
    video_s = 0.0
    with open_pool(PoolSettings(workers=1)) as one, open_pool(PoolSettings(workers=2)) as two:
        for pool in (one, two):  # what is loaded once a worker is loaded
            _filled(place / "warm", clips, pool)
        _plain(place / "warm-run", clips)
        for number in range(rounds):
            progress(f"round {number + 1} of {rounds}")
            taken["plain"].append(_plain(place / "run", clips))
            for name, pool in (("lake", Pool()), ("one", one), ("two", two)):
                seconds, video_s = _filled(place / name, clips, pool)
                taken[name].append(seconds)
    ratios = zip(taken["one"], taken["two"], strict=True)
    costs = zip(taken["lake"], taken["plain"], strict=True)
    return {
        "video_s": video_s,
        **{f"{name}_s": statistics.median(of) for name, of in taken.items()},
        "speedup": statistics.median(a / b for a, b in ratios),
        "overhead": statistics.median(a / b for a, b in costs) - 1.0,
    }


def _beginning(source: Path, target: Path, frames: int) -> Path:
    """The first frames of a video as a clip of its own."""
    reader = cv2.VideoCapture(str(source))
    size = (int(reader.get(cv2.CAP_PROP_FRAME_WIDTH)), int(reader.get(cv2.CAP_PROP_FRAME_HEIGHT)))
    fps = reader.get(cv2.CAP_PROP_FPS)
    writer = cv2.VideoWriter(str(target), cv2.VideoWriter.fourcc(*"MJPG"), fps, size)
    for _ in range(frames):
        there, image = reader.read()
        if not there:
            break
        writer.write(image)
    writer.release()
    reader.release()
    return target


def _plain(folder: Path, clips: Sequence[Path]) -> float:
    begin = time.perf_counter()
    for number, clip in enumerate(clips):
        place = folder / str(number)
        place.mkdir(parents=True)
        watch_into(WatchSettings(str(clip)), place)
    seconds = time.perf_counter() - begin
    shutil.rmtree(folder)
    return seconds


def _filled(folder: Path, clips: Sequence[Path], pool: Pool) -> tuple[float, float]:
    """Seconds that it takes to fill a new lake, and seconds of video."""
    lake = Lake.create(folder)
    begin = time.perf_counter()
    plan = make_plan(lake, [Clip(c, taken=0.0) for c in clips], WatchSettings(""))
    result = fill(lake, plan, pool, _silent)
    seconds = time.perf_counter() - begin
    shutil.rmtree(folder)
    return seconds, result.video_s


def _silent(outcome: ClipOutcome) -> None:
    """Nothing is told of a clip."""

"""Speedup of two workers over one, and overhead of a lake over plain watching."""

from __future__ import annotations

import shutil
import statistics
import time
from collections.abc import Callable, Mapping, Sequence
from functools import partial
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
    """Process the beginnings of missions in turn plainly, into a lake, by one worker, and by two.

    Args:
        place: A working folder.
        missions: Folders with `video.mp4`.
        frames: Frames per mission.
        rounds: Number of repetitions; ratios are medians over them.
        progress: Shows what is being done.

    Returns:
        `video_s` of a round; medians `plain_s`, `lake_s`, `one_s` and `two_s`; `speedup` of two workers;
        relative `overhead` of a lake over plain watching in one process, and `overhead_cpu`, the same in
        processor time, which depends less on the load of the machine.
    """
    clips = [_beginning(m / "video.mp4", place / f"{m.name}.avi", frames) for m in missions]
    taken: dict[str, list[float]] = {name: [] for name in ("plain", "lake", "one", "two")}
    busy: dict[str, list[float]] = {name: [] for name in taken}
    video_s = 0.0
    with open_pool(PoolSettings(workers=1)) as one, open_pool(PoolSettings(workers=2)) as two:
        for pool in (one, two):  # warm up the workers
            _filled(place / "warm", clips, pool)
        _plain(place / "warm-run", clips)
        for number in range(rounds):
            progress(f"round {number + 1} of {rounds}")
            ways: Mapping[str, Callable[[], float]] = {
                "plain": partial(_plain, place / "run", clips),
                "lake": partial(_filled, place / "lake", clips, Pool()),
                "one": partial(_filled, place / "one", clips, one),
                "two": partial(_filled, place / "two", clips, two),
            }
            for name, way in ways.items():
                begin, begun = time.perf_counter(), time.process_time()
                video_s = way()
                taken[name].append(time.perf_counter() - begin)
                busy[name].append(time.process_time() - begun)
    ratios = zip(taken["one"], taken["two"], strict=True)
    return {
        "video_s": video_s,
        **{f"{name}_s": statistics.median(of) for name, of in taken.items()},
        "speedup": statistics.median(a / b for a, b in ratios),
        "overhead": _overhead(taken),
        "overhead_cpu": _overhead(busy),
    }


def _overhead(seconds: Mapping[str, Sequence[float]]) -> float:
    costs = zip(seconds["lake"], seconds["plain"], strict=True)
    return statistics.median(a / b for a, b in costs) - 1.0


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
    """Watch clips into run folders; returns 0 seconds of video, which only a lake reports."""
    for number, clip in enumerate(clips):
        place = folder / str(number)
        place.mkdir(parents=True)
        watch_into(WatchSettings(str(clip)), place)
    shutil.rmtree(folder)
    return 0.0


def _filled(folder: Path, clips: Sequence[Path], pool: Pool) -> float:
    """Fill a new lake; returns the seconds of video."""
    lake = Lake.create(folder)
    plan = make_plan(lake, [Clip(c, taken=0.0) for c in clips], WatchSettings(""))
    result = fill(lake, plan, pool, _silent)
    shutil.rmtree(folder)
    return result.video_s


def _silent(outcome: ClipOutcome) -> None:
    """Ignore an outcome."""

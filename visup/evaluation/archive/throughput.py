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
    folder: Path, missions: Sequence[Path], frames: int, rounds: int, progress: Progress
) -> dict[str, Any]:
    """Process the beginnings of missions in turn plainly, into a lake, by one worker, and by two.

    Args:
        folder: A working folder.
        missions: Folders with `video.mp4`.
        frames: Frames per mission.
        rounds: Number of repetitions; ratios are medians over them.
        progress: Shows what is being done.

    Returns:
        `video_s` of a round; medians `plain_s`, `lake_s`, `one_s` and `two_s`; `speedup` of two workers;
        relative `overhead` of a lake over plain watching in one process, and `overhead_cpu`, the same in
        processor time, which depends less on the load of the machine.
    """
    clips = [_first_frames(m / "video.mp4", folder / f"{m.name}.avi", frames) for m in missions]
    elapsed: dict[str, list[float]] = {name: [] for name in ("plain", "lake", "one", "two")}
    cpu: dict[str, list[float]] = {name: [] for name in elapsed}
    video_s = 0.0
    with open_pool(PoolSettings(workers=1)) as one, open_pool(PoolSettings(workers=2)) as two:
        for pool in (one, two):  # warm up the workers
            _fill_lake(folder / "warm", clips, pool)
        _watch_plainly(folder / "warm-run", clips)
        for number in range(rounds):
            progress(f"round {number + 1} of {rounds}")
            methods: Mapping[str, Callable[[], float]] = {
                "plain": partial(_watch_plainly, folder / "run", clips),
                "lake": partial(_fill_lake, folder / "lake", clips, Pool()),
                "one": partial(_fill_lake, folder / "one", clips, one),
                "two": partial(_fill_lake, folder / "two", clips, two),
            }
            for name, method in methods.items():
                elapsed_begin, cpu_begin = time.perf_counter(), time.process_time()
                video_s = method()
                elapsed[name].append(time.perf_counter() - elapsed_begin)
                cpu[name].append(time.process_time() - cpu_begin)
    ratios = zip(elapsed["one"], elapsed["two"], strict=True)
    return {
        "video_s": video_s,
        **{f"{name}_s": statistics.median(times) for name, times in elapsed.items()},
        "speedup": statistics.median(a / b for a, b in ratios),
        "overhead": _overhead(elapsed),
        "overhead_cpu": _overhead(cpu),
    }


def _overhead(seconds: Mapping[str, Sequence[float]]) -> float:
    costs = zip(seconds["lake"], seconds["plain"], strict=True)
    return statistics.median(a / b for a, b in costs) - 1.0


def _first_frames(source: Path, target: Path, frames: int) -> Path:
    """The first frames of a video as a clip of its own."""
    reader = cv2.VideoCapture(str(source))
    size = (int(reader.get(cv2.CAP_PROP_FRAME_WIDTH)), int(reader.get(cv2.CAP_PROP_FRAME_HEIGHT)))
    fps = reader.get(cv2.CAP_PROP_FPS)
    writer = cv2.VideoWriter(str(target), cv2.VideoWriter.fourcc(*"MJPG"), fps, size)
    for _ in range(frames):
        has_frame, image = reader.read()
        if not has_frame:
            break
        writer.write(image)
    writer.release()
    reader.release()
    return target


def _watch_plainly(folder: Path, clips: Sequence[Path]) -> float:
    """Watch clips into run folders; returns 0 seconds of video, which only a lake reports."""
    for number, clip in enumerate(clips):
        run_folder = folder / str(number)
        run_folder.mkdir(parents=True)
        watch_into(WatchSettings(str(clip)), run_folder)
    shutil.rmtree(folder)
    return 0.0


def _fill_lake(folder: Path, clips: Sequence[Path], pool: Pool) -> float:
    """Fill a new lake; returns the seconds of video."""
    lake = Lake.create(folder)
    plan = make_plan(lake, [Clip(clip, taken=0.0) for clip in clips], WatchSettings(""))
    result = fill(lake, plan, pool, _ignore_outcome)
    shutil.rmtree(folder)
    return result.video_s


def _ignore_outcome(outcome: ClipOutcome) -> None:
    """Ignore an outcome."""

"""`visup eval health`: faults injected into good video, and the reports of the health behaviour.

Every clip is also run without faults, where any report is false.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from visup.agent import Frame, HealthStatus, Observation
from visup.agent.model.errors import SettingsError, VisupError
from visup.evaluation.families import family_of, mean_and_spread
from visup.evaluation.figures import Progress, silent
from visup.evaluation.health.camera_faults import EXPECTED_STATUS, inject
from visup.percepts.health import HealthBehaviour
from visup.percepts.video import open_source
from visup.percepts.video.image_folder import VIDEO_SUFFIXES, images_in

DEFAULT_FAULTS = 100
MAX_LATENCY_S = 1.0
FAULT_FREE_S = (0.6, 1.4)
"""Range of the time before the fault, seconds."""
FAULTY_S = 1.2
GENERIC_NAMES = ("frames", "img1", "video", "clip")
"""Generic names of files and folders."""


@dataclass(frozen=True, slots=True)
class CameraFaultTrial:
    """One fault in one clip.

    Attributes:
        source: The video.
        kind: A key of `EXPECTED_STATUS`.
        skip: Position of the clip in the video, 0 to 1.
        fault_free_s: Seconds before the fault.
        seed: Random seed of the fault.
    """

    source: Path
    kind: str
    skip: float
    fault_free_s: float
    seed: int


@dataclass(frozen=True, slots=True)
class TrialResult:
    """The result of one trial.

    Attributes:
        kind: The fault.
        detected: Whether a fault was reported within a second of its start.
        named: Whether its expected status was reported.
        latency_s: From the start of the fault to the first report, seconds, or None.
        early: Whether a fault was reported before it began.
    """

    kind: str
    detected: bool
    named: bool
    latency_s: float | None
    early: bool


def evaluate_health(
    folder: Path,
    *,
    also: Sequence[Path] | None = None,
    faults: int = DEFAULT_FAULTS,
    seed: int = 0,
    limit: int | None = None,
    progress: Progress = silent,
) -> dict[str, Any]:
    """Inject faults into the videos below a folder, and run them without faults, too.

    Args:
        folder: Searched recursively for video files and folders of images.
        also: Further such folders.
        faults: Number of faults, distributed over kinds and videos.
        seed: Random seed.
        limit: Maximum frames of each video without faults, or None for all.
        progress: Shows what is being done.

    Returns:
        `items` by kind of fault, and `total`, with the keys `clips`, `found` (share reported within
        1 s), `named` (share of them with the right status), `latency_s` (median), `early` (reports
        before the fault); `total` also has `spread` (standard error of the share found and named, clustered
        by `families` of videos), `false_reports`, `hours`, `false_reports_per_hour`, and `ms` (median time of
        a frame). `missed` lists the trials that were not found or not named.

    Raises:
        SettingsError: There is no video below the folder.
    """
    sources = sorted(p for root in (folder, *(also or ())) for p in find_sources(root))
    results: list[TrialResult] = []
    named_correctly: dict[str, float] = {}
    missed: list[dict[str, Any]] = []
    for number, trial in enumerate(plan_trials(sources, faults, seed)):
        progress(f"fault {number + 1} of {faults}")
        results.append(result := run_trial(trial))
        named_correctly[f"{number}/{clip_name(trial.source)}"] = float(
            result.detected and result.named
        )
        if not (result.detected and result.named):
            name = clip_name(trial.source)
            missed.append(
                {"source": name, "kind": trial.kind, "number": number, **_outcome(result)}
            )
    items = {k: _scores([t for t in results if t.kind == k]) for k in EXPECTED_STATUS}
    total = _scores(results)
    total["families"] = len({family_of(n) for n in named_correctly})
    total["spread"] = mean_and_spread(named_correctly)[1]
    total |= _fault_free_figures(sources, limit, progress)
    return {"total": total, "items": {k: v for k, v in items.items() if v}, "missed": missed}


def find_sources(folder: Path) -> list[Path]:
    """Video files and folders of images below a folder, by name; masks are left out.

    Raises:
        SettingsError: There are none.
    """
    paths = [folder, *sorted(folder.rglob("*"))]
    files = [p for p in paths if p.suffix.lower() in VIDEO_SUFFIXES and p.is_file()]
    # Ground truth is next to its images.
    folders = [p for p in paths if p.is_dir() and p.name not in ("masks", "gt")]
    sources = files + [p for p in folders if len(images_in(p)) > 1]
    sources = [p for p in sources if _opens(p)]
    if not sources:
        raise SettingsError(
            "no video was found", where=str(folder), expected="video files or folders of images"
        )
    return sorted(sources)


def clip_name(source: Path) -> str:
    """The name of the clip of a video or frames, since files of all clips may have the same name."""
    return source.parent.name if source.stem.lower() in GENERIC_NAMES else source.stem


def _opens(path: Path) -> bool:
    try:
        with open_source(str(path)):
            return True
    except VisupError:
        return False


def plan_trials(sources: Sequence[Path], faults: int, seed: int) -> Iterator[CameraFaultTrial]:
    """The trials of a campaign: kinds in turn, videos in a shuffled order, the rest drawn."""
    rng = np.random.default_rng(seed)
    kinds = list(EXPECTED_STATUS)
    order: list[int] = []
    for number in range(faults):
        order = order or rng.permutation(len(sources)).tolist()
        yield CameraFaultTrial(
            source=sources[order.pop()],
            kind=kinds[number % len(kinds)],
            skip=float(rng.random()),
            fault_free_s=float(rng.uniform(*FAULT_FREE_S)),
            seed=int(rng.integers(2**31)),
        )


def run_trial(trial: CameraFaultTrial) -> TrialResult:
    """Inject one fault and evaluate the reports."""
    frames = _trial_frames(trial)
    begin = frames[0].time + trial.fault_free_s
    start = next(n for n, f in enumerate(frames) if f.time >= begin)
    since = frames[start].time
    reported = [(f.time, s) for f, s in statuses(inject(frames, start, trial.kind, trial.seed))]
    faults_reported = [(t, s) for t, s in reported if s is not HealthStatus.OK]
    in_time = [(t, s) for t, s in faults_reported if since <= t <= since + MAX_LATENCY_S + 1e-6]
    return TrialResult(
        kind=trial.kind,
        detected=bool(in_time),
        named=any(s is EXPECTED_STATUS[trial.kind] for _, s in in_time),
        latency_s=in_time[0][0] - since if in_time else None,
        early=any(t < since for t, _ in faults_reported),
    )


def _trial_frames(trial: CameraFaultTrial) -> list[Frame]:
    """The frames of a trial; a short video is played to and fro until it is long enough."""
    with open_source(str(trial.source)) as source:
        length = round((trial.fault_free_s + FAULTY_S) * source.fps) + 1
        spare = max(0, (source.frame_count or length) - length)
        source.span = (round(trial.skip * spare), None)  # images before it are not even decoded
        frames = list(islice(source, length))
    return back_and_forth(frames, length)


def back_and_forth(frames: Sequence[Frame], length: int) -> list[Frame]:
    """Frames of a clip of at least two, played alternately forwards and backwards.

    Motion continues at its pace, so that a clip of one second suffices for a trial.
    """
    step = frames[1].time - frames[0].time
    out = list(frames[:length])
    for k in range(len(frames), length):
        pass_number, offset = divmod(k, len(frames) - 1)
        image = frames[len(frames) - 1 - offset if pass_number % 2 else offset].image
        out.append(Frame(out[-1].index + 1, out[-1].time + step, image))
    return out


def statuses(frames: Iterator[Frame] | Sequence[Frame]) -> Iterator[tuple[Frame, HealthStatus]]:
    """The status of each frame by the health behaviour."""
    behaviour = HealthBehaviour()
    for frame in frames:
        empty = Observation(frame.index, frame.time, frame.size)
        for percept in behaviour.perceive(frame, empty, ()):
            yield frame, percept.value.status


def _fault_free_figures(
    sources: Sequence[Path], limit: int | None, progress: Progress
) -> dict[str, Any]:
    """False reports (each run of frames with a fault counts as one) and the time per frame."""
    reports, seconds = 0, 0.0
    ms: list[float] = []
    for path in sources:
        progress(f"{path.name}, unharmed")
        previous = HealthStatus.OK
        with open_source(str(path)) as source:
            last = 0.0
            behaviour = HealthBehaviour()
            for frame in islice(source, limit):
                empty = Observation(frame.index, frame.time, frame.size)
                start = time.perf_counter()
                (percept,) = behaviour.perceive(frame, empty, ())
                ms.append(1e3 * (time.perf_counter() - start))
                status = percept.value.status
                reports += previous is HealthStatus.OK and status is not HealthStatus.OK
                previous, last = status, frame.time
            seconds += last
    hours = seconds / 3600
    return {
        "false_reports": reports,
        "hours": hours,
        "false_reports_per_hour": reports / hours if hours else 0.0,
        "ms": statistics.median(ms) if ms else 0.0,
    }


def _scores(results: Sequence[TrialResult]) -> dict[str, Any]:
    if not results:
        return {}
    latencies = [t.latency_s for t in results if t.latency_s is not None]
    scores: dict[str, Any] = {
        "clips": len(results),
        "found": sum(t.detected for t in results) / len(results),
        "named": sum(t.named for t in results) / len(results),
        "early": sum(t.early for t in results),
    }
    if latencies:
        scores["latency_s"] = statistics.median(latencies)
    return scores


def _outcome(result: TrialResult) -> Mapping[str, Any]:
    return {"found": result.detected, "named": result.named, "early": result.early}

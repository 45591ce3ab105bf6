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
from visup.evaluation.health.camera_faults import EXPECTED, inject
from visup.percepts.health import HealthBehaviour
from visup.percepts.video import open_source
from visup.percepts.video.image_folder import VIDEO_SUFFIXES, images_in

FAULTS = 100
WITHIN_S = 1.0
SOUND_S = (0.6, 1.4)
"""Range of the time before the fault, seconds."""
FAULTY_S = 1.2
UNTOLD = ("frames", "img1", "video", "clip")
"""Generic names of files and folders."""


@dataclass(frozen=True, slots=True)
class CameraFaultTrial:
    """One fault in one clip.

    Attributes:
        source: The video.
        kind: A key of `EXPECTED`.
        skip: Position of the clip in the video, 0 to 1.
        sound_s: Seconds before the fault.
        seed: Random seed of the fault.
    """

    source: Path
    kind: str
    skip: float
    sound_s: float
    seed: int


@dataclass(frozen=True, slots=True)
class TrialResult:
    """The result of one trial.

    Attributes:
        kind: The fault.
        found: Whether a fault was reported within a second of its start.
        named: Whether its expected status was reported.
        latency_s: From the start of the fault to the first report, seconds, or None.
        early: Whether a fault was reported before it began.
    """

    kind: str
    found: bool
    named: bool
    latency_s: float | None
    early: bool


def evaluate_health(
    folder: Path,
    *,
    also: Sequence[Path] | None = None,
    faults: int = FAULTS,
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
    sources = sorted(p for place in (folder, *(also or ())) for p in find_sources(place))
    told: list[TrialResult] = []
    right: dict[str, float] = {}
    missed: list[dict[str, Any]] = []
    for number, trial in enumerate(plan(sources, faults, seed)):
        progress(f"fault {number + 1} of {faults}")
        told.append(result := run_trial(trial))
        right[f"{number}/{clip_name(trial.source)}"] = float(result.found and result.named)
        if not (result.found and result.named):
            name = clip_name(trial.source)
            missed.append({"source": name, "kind": trial.kind, "number": number, **_plain(result)})
    items = {k: _scores([t for t in told if t.kind == k]) for k in EXPECTED}
    total = _scores(told)
    total["families"] = len({family_of(n) for n in right})
    total["spread"] = mean_and_spread(right)[1]
    total |= _unharmed(sources, limit, progress)
    return {"total": total, "items": {k: v for k, v in items.items() if v}, "missed": missed}


def find_sources(folder: Path) -> list[Path]:
    """Video files and folders of images below a folder, by name; masks are left out.

    Raises:
        SettingsError: There are none.
    """
    places = [folder, *sorted(folder.rglob("*"))]
    files = [p for p in places if p.suffix.lower() in VIDEO_SUFFIXES and p.is_file()]
    # Ground truth is next to its images.
    folders = [p for p in places if p.is_dir() and p.name not in ("masks", "gt")]
    found = files + [p for p in folders if len(images_in(p)) > 1]
    found = [p for p in found if _opens(p)]
    if not found:
        raise SettingsError(
            "no video was found", where=str(folder), expected="video files or folders of images"
        )
    return sorted(found)


def clip_name(source: Path) -> str:
    """The name of the clip of a video or frames, since files of all clips may have the same name."""
    return source.parent.name if source.stem.lower() in UNTOLD else source.stem


def _opens(path: Path) -> bool:
    try:
        with open_source(str(path)):
            return True
    except VisupError:
        return False


def plan(sources: Sequence[Path], faults: int, seed: int) -> Iterator[CameraFaultTrial]:
    """The trials of a campaign: kinds in turn, videos in a shuffled order, the rest drawn."""
    rng = np.random.default_rng(seed)
    kinds = list(EXPECTED)
    order: list[int] = []
    for number in range(faults):
        order = order or rng.permutation(len(sources)).tolist()
        yield CameraFaultTrial(
            source=sources[order.pop()],
            kind=kinds[number % len(kinds)],
            skip=float(rng.random()),
            sound_s=float(rng.uniform(*SOUND_S)),
            seed=int(rng.integers(2**31)),
        )


def run_trial(trial: CameraFaultTrial) -> TrialResult:
    """Inject one fault and evaluate the reports."""
    frames = _clip(trial)
    begin = frames[0].time + trial.sound_s
    start = next(n for n, f in enumerate(frames) if f.time >= begin)
    since = frames[start].time
    seen = [(f.time, s) for f, s in statuses(inject(frames, start, trial.kind, trial.seed))]
    bad = [(t, s) for t, s in seen if s is not HealthStatus.OK]
    within = [(t, s) for t, s in bad if since <= t <= since + WITHIN_S + 1e-6]
    return TrialResult(
        kind=trial.kind,
        found=bool(within),
        named=any(s is EXPECTED[trial.kind] for _, s in within),
        latency_s=within[0][0] - since if within else None,
        early=any(t < since for t, _ in bad),
    )


def _clip(trial: CameraFaultTrial) -> list[Frame]:
    """The frames of a trial; a short video is played to and fro until it is long enough."""
    with open_source(str(trial.source)) as source:
        length = round((trial.sound_s + FAULTY_S) * source.fps) + 1
        spare = max(0, (source.frame_count or length) - length)
        source.span = (round(trial.skip * spare), None)  # images before it are not even decoded
        frames = list(islice(source, length))
    return to_and_fro(frames, length)


def to_and_fro(frames: Sequence[Frame], length: int) -> list[Frame]:
    """Frames of a clip of at least two, played alternately forwards and backwards.

    Motion continues at its pace, so that a clip of one second suffices for a trial.
    """
    step = frames[1].time - frames[0].time
    out = list(frames[:length])
    for k in range(len(frames), length):
        turn, place = divmod(k, len(frames) - 1)
        image = frames[len(frames) - 1 - place if turn % 2 else place].image
        out.append(Frame(out[-1].index + 1, out[-1].time + step, image))
    return out


def statuses(frames: Iterator[Frame] | Sequence[Frame]) -> Iterator[tuple[Frame, HealthStatus]]:
    """The status of each frame by the health behaviour."""
    behaviour = HealthBehaviour()
    for frame in frames:
        nothing = Observation(frame.index, frame.time, frame.size)
        for percept in behaviour.perceive(frame, nothing, ()):
            yield frame, percept.value.status


def _unharmed(sources: Sequence[Path], limit: int | None, progress: Progress) -> dict[str, Any]:
    """False reports (each run of frames with a fault counts as one) and the time per frame."""
    reports, seconds = 0, 0.0
    ms: list[float] = []
    for path in sources:
        progress(f"{path.name}, unharmed")
        before = HealthStatus.OK
        with open_source(str(path)) as source:
            last = 0.0
            behaviour = HealthBehaviour()
            for frame in islice(source, limit):
                nothing = Observation(frame.index, frame.time, frame.size)
                start = time.perf_counter()
                (percept,) = behaviour.perceive(frame, nothing, ())
                ms.append(1e3 * (time.perf_counter() - start))
                status = percept.value.status
                reports += before is HealthStatus.OK and status is not HealthStatus.OK
                before, last = status, frame.time
            seconds += last
    hours = seconds / 3600
    return {
        "false_reports": reports,
        "hours": hours,
        "false_reports_per_hour": reports / hours if hours else 0.0,
        "ms": statistics.median(ms) if ms else 0.0,
    }


def _scores(told: Sequence[TrialResult]) -> dict[str, Any]:
    if not told:
        return {}
    latencies = [t.latency_s for t in told if t.latency_s is not None]
    out: dict[str, Any] = {
        "clips": len(told),
        "found": sum(t.found for t in told) / len(told),
        "named": sum(t.named for t in told) / len(told),
        "early": sum(t.early for t in told),
    }
    if latencies:
        out["latency_s"] = statistics.median(latencies)
    return out


def _plain(told: TrialResult) -> Mapping[str, Any]:
    return {"found": told.found, "named": told.named, "early": told.early}
